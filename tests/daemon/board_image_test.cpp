// The core drives the commutator board that one can build: its image in simavr, on virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>

#include "daemon/lab.h"
#include "sim/avr/avr_board.h"
#include "tables/table_file.h"

namespace bushd::test {
namespace {

constexpr std::uint32_t kStartHz = 100;
constexpr std::uint32_t kBaud = 500'000;

std::string with_image() {
  return "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/null\"\nbaud = 500000\n"
         "start_hz = 100\n"
         "[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n"
         "[[motor]]\nname = \"m0\"\nmcu = \"board\"\noutput = 0\ngroup = \"axes\"\n"
         "[[motor]]\nname = \"m5\"\nmcu = \"board\"\noutput = 5\ngroup = \"axes\"\n";
}

class ImageLab : public Lab {
 public:
  ImageLab() : Lab(with_image()) {
    auto made = std::make_unique<sim::AvrBoard>(COMMUTATOR_IMAGE, kBaud, kStartHz);
    image = made.get();
    replace_board(0, std::move(made));
    connect();
  }
  sim::BoardMotors& motors() { return image->motors(); }
  Answer move(const std::string& motor, std::int64_t steps) {
    return wait(send(Ask::kMoveBy, {motor}, {steps}), 60);
  }
  bool trusted(const std::string& name) const { return motor(name).trust == api::Trust::kKnown; }

  sim::AvrBoard* image = nullptr;
};

TEST(BoardImage, MovesItsMotorsByTheTable) {
  ImageLab lab;
  EXPECT_EQ(lab.move("m0", 300).result, "reached");
  EXPECT_EQ(lab.move("m5", -120).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 300);
  EXPECT_EQ(lab.shaft_steps("m5"), -120);
  EXPECT_TRUE(lab.trusted("m0") && lab.trusted("m5"));
  // From rest to rest by the codes of the table, and no later than the line, this lab's look every
  // 0.2 ms and the board's own 31 us make it.
  const auto loaded = tables::load(*tables::find("bushd2-constant", tables::shipped_directories()));
  const bushd_ramp& accel = (*loaded)->view().accel;
  const auto& steps = lab.motors().steps();
  ASSERT_EQ(steps.size(), 420u);
  const std::size_t n = 300;
  for (std::size_t k = 1; k < n; ++k) {
    const std::int64_t code = accel.code[std::min<std::size_t>({k, n - 1 - k, accel.count - 1u})];
    const auto apart_ns = steps[k].time_ns - steps[k - 1].time_ns;
    ASSERT_GE(apart_ns, code * 40'000) << k;
    ASSERT_LE(apart_ns, code * 40'000 + 2 * 20'000 + 250'000 + 31'000) << k;
  }
}

TEST(BoardImage, LimitEndsAMotion) {
  ImageLab lab;
  lab.motors().motor(0).right_limit_at = 200;
  EXPECT_EQ(lab.move("m0", 1000).result, "limit");
  EXPECT_GE(lab.shaft_steps("m0"), 200);
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  EXPECT_EQ(lab.move("m0", -300).result, "reached");
  EXPECT_TRUE(lab.trusted("m0"));
}

// Each trouble leaves one step unknown at the most, and only where the motor is uncertain then.
TEST(BoardImage, WhateverHappensCountsAreRightOrSaidToBeUncertain) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto upto = [&random](unsigned n) { return static_cast<std::int64_t>(random() % n); };
    ImageLab lab;
    lab.motors().motor(0).right_limit_at = 500;
    for (int trouble = 0; trouble < 6; ++trouble) {
      const auto move = lab.send(Ask::kMoveBy, {"m0"}, {upto(800) - 400});
      lab.run_for(static_cast<double>(upto(500)) * 1e-3);
      const std::int64_t kind = upto(6);
      if (kind == 0) lab.unplug(0);
      if (kind == 1) lab.motors().supply = false;
      if (kind == 2) lab.motors().motor(0).connected = false;
      if (kind == 3) lab.send(Ask::kStop, {"m0"});
      if (kind == 4) lab.image->send_break(lab.now_us() * 1000);
      if (kind == 5) lab.image->node().hang();
      lab.run_for(static_cast<double>(upto(300)) * 1e-3);
      lab.motors().supply = lab.motors().motor(0).connected = true;
      if (kind == 0) lab.plug(0);
      ASSERT_TRUE(lab.run_until([&] { return lab.has_result(move); }, 60));
      lab.run_for(1.2);
      if (lab.trusted("m0")) {
        ASSERT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0")) << trouble;
      } else {
        lab.wait(lab.send(Ask::kSetPosition, {"m0"}, {lab.shaft_steps("m0")}));
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test
