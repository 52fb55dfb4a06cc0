// What MCUs tell of their programs, in words for people.
#pragma once

#include <cstdint>
#include <string>

#include "api/words.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

const char* stage_word(std::uint8_t stage);  // of bushd_program_stage

struct ProgramEnd {
  api::Outcome outcome;
  std::string reason;
};
// Precondition: it has ended.
ProgramEnd end_of_program(const bushd_program_state& state, const Mcu& mcu);

}  // namespace bushd::daemon
