// Programs of MCUs as people read them.
#pragma once

#include <string>
#include <vector>

#include "api/reply.h"
#include "client/status.h"

namespace bushctl {

// What it will do: memory and duration, then each motor's way, in its unit as far as `status` tells
// one, then what else there is to know before it is run.
std::vector<std::string> lines(const bushd::api::ProgramEntry& program,
                               const bushd::client::Status& status);

// A line for each MCU, under a line of names.
std::vector<std::string> table(const bushd::api::ProgramList& list);

// How far the program of this name has come to its MCU: "scan: 512 bytes have arrived at hall:1".
// "": it is not on its way.
std::string upload_text(const bushd::api::ProgramList& list, const std::string& program);

}  // namespace bushctl
