// The core drives the board with a converter that one can build: its image in simavr, on virtual
// time, with a converter that is not what the configuration says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "daemon/board_image_lab.h"

namespace bushd::test::converter_image {
namespace {

using testing::HasSubstr;
using Character = sim::FrequencyConverter::Character;

constexpr double kHzPerCode = 10;

class ConverterImageLab : public ImageLab {
 public:
  explicit ConverterImageLab(const Character& character = {.hz_per_code = kHzPerCode})
      : ImageLab("converter = { max_hz = 2500, max_code = 250 }",
                 std::make_unique<sim::AvrBoard>(CONVERTER_IMAGE, kBaud,
                                                 sim::FrequencyConverter(character))) {}
};

// An interval is 1 / (g K) at least, since K is 0 while the line is busy, which takes longer (40
// us) than the image takes to see a pulse (16 us); the image is up to 45 us late.
TEST(ConverterImage, MovesItsMotorsByTheTableAndItsConverter) {
  for (const double gain : {0.9, 1.1}) {
    SCOPED_TRACE(gain);
    ConverterImageLab lab({.hz_per_code = kHzPerCode * gain});
    const auto period_ns = static_cast<std::int64_t>(1e9 / (kHzPerCode * gain));
    expect_moves_by_codes(
        lab, converter_codes(), [&](std::int64_t code) { return period_ns / code; }, 45'000);
    EXPECT_EQ(lab.image.converter().pulses(), 420u) << "none is lost, and none is in vain";
  }
}

TEST(ConverterImage, AConverterWithoutPulsesEndsTheMotion) {
  ConverterImageLab lab;
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {1000});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m0") >= 100; }));
  lab.image.set_converter({.hz_per_code = kHzPerCode, .gives_pulses = false});
  EXPECT_THAT(lab.wait(move).reason, HasSubstr("the board's converter gave no pulse within 1 s"));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.motor("m0").position_steps, lab.shaft_steps("m0"));
  EXPECT_FALSE(lab.trusted("m0"));
}

TEST(ConverterImage, WhateverHappensCountsAreRightOrSaidToBeUncertain) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    ConverterImageLab lab;
    const auto is_another = [&](const Upto& upto) {
      lab.image.set_converter(
          {.hz_per_code = kHzPerCode * (0.5 + 0.01 * static_cast<double>(upto(100))),
           .offset_codes = 0.1 * static_cast<double>(upto(50)) - 2.5,
           .drift_per_s = 0.001 * static_cast<double>(upto(20)) - 0.01});
    };
    expect_counts_right_or_uncertain(
        lab, seed, is_another,
        [&] { lab.image.set_converter({.hz_per_code = kHzPerCode, .gives_pulses = false}); },
        [&] { lab.image.set_converter({.hz_per_code = kHzPerCode}); });
  }
}

}  // namespace
}  // namespace bushd::test::converter_image
