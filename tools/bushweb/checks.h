// What is to be said of a table before it is stored.
#pragma once

#include <cstdint>

#include "api/table_file.h"
#include "messages.h"

namespace bushweb {

// What tables::check() refuses is refused; otherwise the diagnostics of `bushtab check` for any
// motor, each with its place.
Text checked(std::int64_t id, const api::TableFile& table);

}  // namespace bushweb
