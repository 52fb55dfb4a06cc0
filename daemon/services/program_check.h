// Whether a text is a program that an MCU of the installation can carry out, as things are now, and
// what it would do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "base/ids.h"
#include "base/result.h"
#include "daemon/model/installation.h"
#include "programs/compile.h"
#include "tables/table.h"

namespace bushd::daemon {

// A walk through more frames than this is cut: it is made while motors move.
inline constexpr std::size_t kMostWalkedFrames = 20'000;

struct CheckedProgram {
  std::string name{};
  programs::Program text{};
  McuId mcu{};
  std::vector<MotorId> motors{};      // in the text's order
  std::vector<std::uint8_t> bytes{};  // for the MCU
  std::uint32_t crc = 0;              // of these
  programs::Rehearsal walk{};         // from where the motors stand
  tables::TablePtr line_table{};      // of its lines; null: it has none
  bool line_table_is_there = false;   // in a bank of the MCU
  std::vector<std::string> tables{};  // what their bytes are: of its motors, then of its lines
};

// Errors name file, line, motor, cause and remedy.
Result<programs::Program> parse_program(const api::PutProgram& request);
// Its bytes, without a walk.
Result<CheckedProgram> compile_program(const Installation& installation, const std::string& name,
                                       programs::Program text);
Result<CheckedProgram> check_program(const Installation& installation, const std::string& name,
                                     programs::Program text);

// What is told of a checked one; what its MCU tells is added by who knows that.
api::ProgramEntry entry_of(const Installation& installation, const CheckedProgram& program);

}  // namespace bushd::daemon
