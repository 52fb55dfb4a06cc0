// Limit and home switches of a motor at any inputs of its MCU.
#pragma once

#include "firmware/streams.h"

namespace bushd::test {

inline constexpr std::uint8_t kSwitched = 1;
inline constexpr std::uint16_t kSwitchedBit = 1u << kSwitched;

constexpr std::uint16_t bit(unsigned input) {
  return static_cast<std::uint16_t>(1u << input);
}

class Switches : public Streams {
 protected:
  Switches() : Streams({.motors = 16, .queue_ticks = 256, .code_count = 400}) {}

  static constexpr std::uint8_t kPositive = 9;
  static constexpr std::uint8_t kNegative = 14;
  static constexpr std::uint8_t kHome = 3;
  static constexpr bushd_motor_inputs kApart{kSwitched, kPositive, kNegative, kHome};

  void wire(const bushd_motor_inputs& inputs = kApart, const InputSettings& settings = both()) {
    EXPECT_EQ(rig.set_inputs(settings), BUSHD_OK);
    EXPECT_EQ(rig.motor_inputs(inputs), BUSHD_OK);
  }
  static InputSettings both() {
    return {.limit_positive = kSwitchedBit, .limit_negative = kSwitchedBit};
  }
  bushd_status start(std::uint8_t motor, int steps) { return rig.start(law, steps, motor); }
  void pins(unsigned inputs) { rig.pins({static_cast<std::uint16_t>(inputs), 0}); }
  // Half a move of 60 steps, and then the switch.
  void run_into(unsigned inputs) {
    ASSERT_EQ(start(kSwitched, 60), BUSHD_OK);
    rig.pass(30);
    pins(inputs);
  }
  void expect_forbidden(std::uint16_t positive, std::uint16_t negative) {
    rig.pass();
    const bushd_report report = rig.poll();
    EXPECT_EQ(report.forbidden_positive, positive);
    EXPECT_EQ(report.forbidden_negative, negative);
  }
};

}  // namespace bushd::test
