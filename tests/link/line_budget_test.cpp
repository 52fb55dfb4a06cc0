// The budget refuses configurations, so it must not promise what the line cannot keep; and it
// should not refuse what it could.
#include "link/line_budget.h"

#include <array>
#include <vector>

#include "link/slave.h"

namespace bushd::test {
namespace {

using link::line_load;

TEST(LineBudget, ByHand) {
  // 16 fine motors: 6 ticks a frame; 1 delimiter + 9 + 9 + 2 x 16 + 6 x 32 = 243 bytes every 15.36
  // ms. Every 50 ms a poll, 10 + 1 + 3 bytes and 1 ms, and a report, 10 + 78 + 96 bytes and 0.6 ms.
  // A time mark: 10 + 19 bytes every 500 ms.
  const std::array<std::uint8_t, 1> one = {16};
  const double bytes_per_s = 243 / 0.01536 + (14 + 184) / 0.05 + 29 / 0.5;
  EXPECT_NEAR(line_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, one),
              bytes_per_s * 10 / 500'000 + 1.6 / 50, 1e-9);
  // Two MCUs without motors are still asked.
  const std::array<std::uint8_t, 2> idle = {0, 0};
  EXPECT_NEAR(line_load(1'000'000, 2'560'000, BUSHD_FORMAT_COARSE, idle),
              ((11 + 2 * (3 + 10 + 78)) / 0.05 + 29 / 0.5) * 10 / 1e6 + 2.2 / 50, 1e-9);
  // One coarse motor: 16 ticks a frame, 1 + 9 + 9 + 2 + 16 bytes every 16 ms.
  const std::array<std::uint8_t, 1> single = {1};
  EXPECT_NEAR(line_load(250'000, 1'000'000, BUSHD_FORMAT_COARSE, single),
              (37 / 0.016 + (14 + 10 + 84) / 0.05 + 29 / 0.5) * 10 / 250'000 + 1.6 / 50, 1e-9);
}

TEST(LineBudget, GrowsWithEverythingThatCosts) {
  const std::vector<std::uint8_t> few = {4, 4};
  const std::vector<std::uint8_t> more = {4, 5};
  const double load = line_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, few);
  EXPECT_LT(load, line_load(500'000, 2'560'000, BUSHD_FORMAT_FINE, more));
  EXPECT_LT(load, line_load(250'000, 2'560'000, BUSHD_FORMAT_FINE, few));
  EXPECT_LT(load, line_load(500'000, 2'000'000, BUSHD_FORMAT_FINE, few));
  EXPECT_GT(load, line_load(500'000, 2'560'000, BUSHD_FORMAT_COARSE, few));
}

// What master and slaves really put on the line while all motors accelerate (running delays change
// from frame to frame) for ten seconds.
TEST(LineBudget, IsACloseUpperBoundOfWhatIsSent) {
  for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
    for (const int slaves : {1, 2}) {
      for (const int motors : {1, 3, 8, 16}) {
        FakeBus bus(slaves, motors, format);
        if (format == BUSHD_FORMAT_COARSE) {
          bus.source.displacement = [](std::uint8_t, link::Tick t) {
            return std::int16_t(t % 256);
          };
        }
        bus.connect();
        for (std::size_t i = 0; i < bus.slaves.size(); ++i) {
          for (std::uint8_t m = 0; m < motors; ++m) {
            bus.master->begin(i, m, bus.master->earliest_start(bus.now_us, i, m));
          }
        }
        bus.run_for(1'000'000);
        const std::int64_t before = bus.master_bytes + bus.slave_bytes;
        bus.run_for(10'000'000);
        const auto bytes = static_cast<double>(bus.master_bytes + bus.slave_bytes - before);
        // Twenty times a second the line is quiet before each answer.
        const double quiet_s = 20 * (1e-3 + slaves * 0.6e-3);
        const double sent = bytes * 10 / FakeBus::kBaud / 10.0 + quiet_s;
        const std::vector<std::uint8_t> all(bus.slaves.size(), static_cast<std::uint8_t>(motors));
        const double budget = line_load(FakeBus::kBaud, FakeBus::kTickNs, format, all);
        EXPECT_LE(sent, budget * 1.002) << "one frame more or less: 0.2 % of ten seconds";
        EXPECT_GE(sent, budget * 0.9) << format << ' ' << slaves << ' ' << motors;
        EXPECT_EQ(bus.count(link::Event::Kind::kLateStart), 0);
      }
    }
  }
}

}  // namespace
}  // namespace bushd::test
