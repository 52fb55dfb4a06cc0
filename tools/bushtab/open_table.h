#pragma once

#include <string>

#include "base/result.h"
#include "tables/table.h"

namespace bushtab {

// A table given on the command line, by path or by name (commands.h).
bushd::Result<bushd::tables::TablePtr> open_table(const std::string& table);

// Prints the error to stderr and returns kRefused.
int refuse(const bushd::Error& error);

}  // namespace bushtab
