// The voltage-to-frequency converter of simulations, against the integral of its frequency.
#include "sim/frequency_converter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace bushd::sim {
namespace {

constexpr TimeNs kSecondNs = 1'000'000'000;

std::vector<TimeNs> pulses_of(FrequencyConverter& converter, TimeNs until_ns) {
  std::vector<TimeNs> pulses;
  while (converter.next_pulse_ns() <= until_ns) {
    pulses.push_back(converter.next_pulse_ns());
    converter.advance(pulses.back());
    EXPECT_EQ(converter.pulses(), pulses.size());
  }
  return pulses;
}

TEST(FrequencyConverter, GivesGainTimesCodePulsesASecond) {
  FrequencyConverter converter({.hz_per_code = 10, .offset_codes = 0.5});
  EXPECT_EQ(converter.next_pulse_ns(), 200'000'000) << "of the offset alone";
  converter.set_code(0, 25);
  const auto pulses = pulses_of(converter, 10 * kSecondNs);
  // 255 Hz; each pulse is rounded up to a nanosecond.
  ASSERT_EQ(pulses.size(), 2549u);
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const double exact_ns = static_cast<double>(i + 1) * 1e9 / 255;
    ASSERT_GE(static_cast<double>(pulses[i]), exact_ns - 1e-3);
    ASSERT_LE(static_cast<double>(pulses[i]), exact_ns + static_cast<double>(i + 1) + 1e-3);
  }
}

// The periods up to t are  f (t + d t^2 / 2).
TEST(FrequencyConverter, DriftsWithTime) {
  for (const double drift : {0.3, -0.05}) {
    FrequencyConverter converter({.hz_per_code = 1, .drift_per_s = drift});
    converter.set_code(0, 100);
    const auto pulses = pulses_of(converter, 5 * kSecondNs);
    ASSERT_GT(pulses.size(), 400u);
    for (std::size_t i = 0; i < pulses.size(); ++i) {
      const double s = static_cast<double>(pulses[i]) * 1e-9;
      ASSERT_NEAR(100 * (s + drift * s * s / 2), static_cast<double>(i + 1), 2e-4) << i;
    }
  }
}

TEST(FrequencyConverter, GoesOnWithWhatIsOverOfAPeriod) {
  FrequencyConverter converter({.hz_per_code = 1});
  converter.set_code(0, 10);
  converter.advance(75'000'000);  // three quarters
  converter.set_code(75'000'000, 0);
  EXPECT_EQ(converter.next_pulse_ns(), FrequencyConverter::kNever);
  converter.set_code(kSecondNs, 5);
  EXPECT_NEAR(static_cast<double>(converter.next_pulse_ns()), 1.05e9, 2);
}

TEST(FrequencyConverter, StandsStillBelowZeroAndWithItsCableOff) {
  FrequencyConverter converter({.hz_per_code = 10, .offset_codes = -2});
  converter.set_code(0, 2);
  EXPECT_EQ(converter.next_pulse_ns(), FrequencyConverter::kNever);
  converter.set_code(0, 3);
  EXPECT_EQ(converter.next_pulse_ns(), 100'000'000);
  converter.set_character(50'000'000, {.hz_per_code = 10, .gives_pulses = false});
  EXPECT_EQ(converter.next_pulse_ns(), FrequencyConverter::kNever);
  converter.advance(20 * kSecondNs);
  EXPECT_EQ(converter.pulses(), 0u);
  // Its gain falls to 0 within a second, and half a period more is never over.
  FrequencyConverter dying({.hz_per_code = 1, .drift_per_s = -1});
  dying.set_code(0, 3);
  EXPECT_EQ(pulses_of(dying, 100 * kSecondNs).size(), 1u);
}

}  // namespace
}  // namespace bushd::sim
