// The budget refuses configurations, so it must not promise what the line cannot keep; and it
// should not refuse what it could.
#include "bus/bus_budget.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "source_path.h"

namespace bushd::fieldbus {
namespace {

TEST(BusBudget, ByHand) {
  // 16 fine motors: 6 ticks a frame; 1 delimiter + 9 + 9 + 2 x 16 + 6 x 32 = 243 bytes every 15.36
  // ms. Every 50 ms a poll, 10 + 1 + 5 bytes and 1 ms, and the window of a report, 10 + 50 + 96
  // bytes, 0.51 ms and a byte time. A time mark: 10 + 19 bytes every 500 ms.
  const std::array<std::uint8_t, 1> one = {16};
  const double bytes_per_s = 243 / 0.01536 + (16 + 156) / 0.05 + 29 / 0.5;
  EXPECT_NEAR(bus_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, one),
              bytes_per_s * 10 / 500'000 + 1.53 / 50, 1e-9);
  // Two MCUs without motors are still asked.
  const std::array<std::uint8_t, 2> idle = {0, 0};
  EXPECT_NEAR(bus_load(1'000'000, 2'560'000, BUSHD_FORMAT_COARSE, idle),
              ((11 + 2 * (5 + 10 + 38)) / 0.05 + 29 / 0.5) * 10 / 1e6 + 2.04 / 50, 1e-9);
  // One coarse motor: 16 ticks a frame, 1 + 9 + 9 + 2 + 16 bytes every 16 ms.
  const std::array<std::uint8_t, 1> single = {1};
  EXPECT_NEAR(bus_load(250'000, 1'000'000, BUSHD_FORMAT_COARSE, single),
              (37 / 0.016 + (16 + 10 + 56) / 0.05 + 29 / 0.5) * 10 / 250'000 + 1.55 / 50, 1e-9);
}

// Sixteen motors by states: two frames of a delimiter, 9 + 8 bytes and 21 for each motor, ten times
// a second.
TEST(BusBudget, PollsAndStreamsAddUp) {
  const std::array<std::uint8_t, 1> one = {16};
  const std::array<Streamed, 1> states = {{{.by_states = 16}}};
  EXPECT_NEAR(stream_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, states),
              (2 * 18 + 16 * 21) / 0.1 * 10 / 500'000, 1e-9);
  const std::array<Streamed, 1> ticks = {{{.by_ticks = 16}}};
  EXPECT_NEAR(poll_load(500'000, one) + stream_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, ticks),
              bus_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, one), 1e-12);
  // States are no more than ticks, since these are sent where they are shorter.
  const std::array<Streamed, 1> few = {{{.by_ticks = 2, .by_states = 14}}};
  EXPECT_LE(stream_load(230'400, 10'000'000, BUSHD_FORMAT_COARSE, few),
            stream_load(230'400, 10'000'000, BUSHD_FORMAT_COARSE, ticks));
  const std::array<Streamed, 1> none = {};
  EXPECT_EQ(stream_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, none), 0);
}

TEST(BusBudget, GrowsWithEverythingThatCosts) {
  const std::vector<std::uint8_t> few = {4, 4};
  const std::vector<std::uint8_t> more = {4, 5};
  const double load = bus_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, few);
  EXPECT_LT(load, bus_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, more));
  EXPECT_LT(load, bus_load(250'000, 2'560'000, BUSHD_FORMAT_FINE, few));
  EXPECT_LT(load, bus_load(500'000, 2'000'000, BUSHD_FORMAT_FINE, few));
  EXPECT_GT(load, bus_load(500'000, 2'560'000, BUSHD_FORMAT_COARSE, few));
}

// In ticks of 2560 us, with 16 motors on each MCU.
TEST(BusBudget, ConfigurationDocumentHasTheSameLoads) {
  std::ifstream file(test::source_path("docs/configuration.md"));
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  for (const std::uint32_t baud : {115'200u, 230'400u, 500'000u, 1'000'000u}) {
    std::string row = "| " + std::to_string(baud);
    for (const bushd_format format : {BUSHD_FORMAT_COARSE, BUSHD_FORMAT_FINE}) {
      for (const std::size_t mcus : {1u, 2u, 4u}) {
        const double load =
            bus_load(baud, 2'560'000, format, std::vector<std::uint8_t>(mcus, std::uint8_t{16}));
        row += " | " + (load > kMaxBusLoad ? std::string("refused")
                                           : std::to_string(std::lround(load * 100)) + " %");
      }
    }
    EXPECT_NE(document.find(row + " |\n"), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace bushd::fieldbus
