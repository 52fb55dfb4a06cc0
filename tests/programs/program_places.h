// Two motors of an MCU, and programs for them.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "engine/tables.h"
#include "programs/compile.h"
#include "results.h"

namespace bushd::test {

using testing::HasSubstr;

inline Law program_law() {
  Law law;
  law.accel = {250, 200, 150, 110};
  law.decel = {240, 160};
  law.cruise = 100;
  law.unit_ns = 40'000;
  return law;
}

// "x" at output 5 in steps, "theta" at output 2 with 400 steps per degree.
class ProgramPlaces : public testing::Test {
 protected:
  ProgramPlaces() {
    motors_[0].name = "x";
    motors_[0].output = 5;
    motors_[0].bank = 1;
    motors_[1].name = "theta";
    motors_[1].output = 2;
    motors_[1].bank = 3;
    motors_[1].coordinates = *units::Coordinates::make(
        {.unit = "deg", .steps_per_unit = {400, 1}, .negative = false, .offset = 0});
    for (programs::MotorPlace& motor : motors_) {
      motor.table = table_.view();
      motor.least_steps = -5000;
      motor.most_steps = 6000;
    }
    mcu_.name = "MCU 3";
    mcu_.memory = 500;
    mcu_.tick_ns = 2'560'000;
    mcu_.line_bank = 7;
    mcu_.line_table = table_.view();
  }

  static Result<programs::Program> parse(
      const std::string& text,
      const programs::ReadPoints& points = [](const std::string&) -> Result<std::string> {
        return fail("no file");
      }) {
    return programs::parse(text, "p.toml", points);
  }
  static programs::Program parsed(const std::string& frames) {
    return good(parse("motors = [\"x\", \"theta\"]\n" + frames));
  }
  Result<std::vector<std::uint8_t>> compile(const programs::Program& program) {
    return programs::compile(program, mcu_, motors_);
  }
  Result<programs::Rehearsal> rehearse(const std::string& frames) {
    const programs::Program program = parsed(frames);
    const auto bytes = compile(program);
    if (!bytes) return fail(bytes.error());
    return programs::rehearse(program, mcu_, motors_, *bytes);
  }

  const TestTable table_{program_law(), true};
  std::array<programs::MotorPlace, 2> motors_{};
  programs::McuPlace mcu_{};
};

}  // namespace bushd::test
