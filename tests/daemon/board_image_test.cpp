// The core drives the commutator board that one can build: its image in simavr, on virtual time.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "daemon/board_image_lab.h"

namespace bushd::test {
namespace {

class DelayImageLab : public ImageLab {
 public:
  DelayImageLab()
      : ImageLab("start_hz = 100", std::make_unique<sim::AvrBoard>(COMMUTATOR_IMAGE, kBaud, 100u)) {
  }
};

TEST(BoardImage, MovesItsMotorsByTheTable) {
  DelayImageLab lab;
  expect_moves_by_codes(
      lab, delay_codes(), [](std::int64_t code) { return code * 40'000; }, 31'000);
}

TEST(BoardImage, LimitEndsAMotion) {
  DelayImageLab lab;
  lab.motors().motor(0).right_limit_at = 200;
  EXPECT_EQ(lab.move("m0", 1000).result, "limit");
  EXPECT_GE(lab.shaft_steps("m0"), 200);
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  EXPECT_EQ(lab.move("m0", -300).result, "reached");
  EXPECT_TRUE(lab.trusted("m0"));
}

TEST(BoardImage, WhateverHappensCountsAreRightOrSaidToBeUncertain) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    DelayImageLab lab;
    expect_counts_right_or_uncertain(
        lab, seed, [](const Upto&) {}, [&] { lab.send(Ask::kStop, {"m0"}); }, [] {});
  }
}

}  // namespace
}  // namespace bushd::test
