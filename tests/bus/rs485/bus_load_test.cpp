// The budget of the bus against what master and slaves really put on it.
#include <vector>

#include "bus/bus_budget.h"
#include "bus/rs485/slave.h"

namespace bushd::test {
namespace {

// Whether an answer fills its window or not, nothing else is sent in it.
double bytes_of_windows(const FakeBus& bus) {
  double bytes = 0;
  for (const Heard& poll : bus.heard_of(BUSHD_MSG_POLL)) {
    for (std::size_t room = 5; room < poll.payload.size(); room += 5) {
      bytes += poll.payload[room] + 1.0 + BUSHD_FRAME_OVERHEAD;
    }
  }
  return bytes;
}

// All motors accelerate, so running delays change from frame to frame, for ten seconds.
TEST(BusBudget, IsACloseUpperBoundOfWhatIsSent) {
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
            bus.master->begin(McuIndex{i}, m,
                              bus.master->earliest_start(bus.now_us, McuIndex{i}, m));
          }
        }
        bus.run_for(1'000'000);
        const std::int64_t before = bus.master_bytes;
        bus.heard.clear();
        bus.run_for(10'000'000);
        const auto bytes = static_cast<double>(bus.master_bytes - before) + bytes_of_windows(bus);
        // Twenty times a second the line is quiet before each answer.
        const double quiet_s = 20 * (1e-3 + slaves * 0.53e-3);
        const double sent = bytes * 10 / FakeBus::kBaud / 10.0 + quiet_s;
        const std::vector<std::uint8_t> all(bus.slaves.size(), static_cast<std::uint8_t>(motors));
        const double budget = fieldbus::bus_load(FakeBus::kBaud, FakeBus::kTickNs, format, all);
        EXPECT_LE(sent, budget * 1.002) << "one frame more or less: 0.2 % of ten seconds";
        EXPECT_GE(sent, budget * 0.9) << format << ' ' << slaves << ' ' << motors;
        EXPECT_EQ(bus.count<link::StartMissed>(), 0);
      }
    }
  }
}

// The share of ten seconds without motion in which the line carries bytes.
double share_at_rest(int slaves, std::uint32_t baud) {
  FakeBus bus(slaves, BUSHD_MOTORS_PER_MCU, BUSHD_FORMAT_FINE, FakeBus::kTickNs, baud);
  bus.connect();
  bus.run_for(2'000'000);
  const std::int64_t before = bus.master_bytes + bus.slave_bytes;
  bus.run_for(10'000'000);
  const std::int64_t bytes = bus.master_bytes + bus.slave_bytes - before;
  return static_cast<double>(bytes) * 10 / baud / 10.0;
}

TEST(BusLoad, AtRestIsAFewPercent) {
  EXPECT_LE(share_at_rest(2, 500'000), 0.05);
  EXPECT_LE(share_at_rest(16, 1'000'000), 0.15);
}

// The reads of so many polls, ten seconds of them.
double reads_of_a_poll(FakeBus& bus) {
  bus.reads = 0;
  bus.heard.clear();
  bus.run_for(10'000'000);
  return static_cast<double>(bus.reads) / static_cast<double>(bus.heard_of(BUSHD_MSG_POLL).size());
}

void begin_all(FakeBus& bus) {
  for (std::size_t i = 0; i < bus.slaves.size(); ++i) {
    bus.master->begin(McuIndex{i}, 0, bus.master->earliest_start(bus.now_us, McuIndex{i}, 0));
  }
  bus.run_for(1'000'000);
}

// What wakes the daemon is what many motors cost it.
TEST(BusLoad, AllAnswersOfAPollThatNobodyWaitsForAreReadAtOnce) {
  FakeBus bus(4);
  bus.connect();
  bus.run_for(2'000'000);
  // The last answer by itself, where the one before is there when the first could be over.
  EXPECT_LE(reads_of_a_poll(bus), 2.0);
  begin_all(bus);
  EXPECT_LE(reads_of_a_poll(bus), 2.0) << "in motion too";
  bus.slaves[3].answers = false;
  bus.run_for(100'000);
  EXPECT_LE(reads_of_a_poll(bus), 2.1) << "the last one owes its answer: of ten polls one is read "
                                          "a third time, when that is overdue";
}

TEST(BusLoad, AnswersAreReadAsTheyComeWhereOneTellsOfAnEnd) {
  FakeBus bus(4);
  bus.connect();
  begin_all(bus);
  const auto listens_at_once = [&bus] { return bus.master->listen_from_us() == INT64_MIN; };
  const auto polled = [&bus] { return !bus.heard_of(BUSHD_MSG_POLL).empty(); };
  bus.heard.clear();
  ASSERT_TRUE(bus.run_until(polled));
  EXPECT_FALSE(listens_at_once()) << "their ends are far off";
  bus.run_for(30'000);
  const link::Tick end = bus.master->tick_at(bus.now_us) + 2;
  bus.source.end = [end](std::uint8_t) { return end; };
  bus.heard.clear();
  ASSERT_TRUE(bus.run_until(polled));
  EXPECT_TRUE(listens_at_once());
}

// Two answers took as long as the line, and were read late by what the third one took.
TEST(BusLoad, WhatIsLeftUnreadIsNoLatency) {
  FakeBus bus(4);
  bus.turnaround_us = 0;
  bus.connect();
  bus.run_for(5'000'000);
  EXPECT_LE(bus.master->bus_health().latency.recent_us, 1'000);
}

TEST(BusLoad, OneMcuIsListenedToAtAnyTime) {
  FakeBus bus;
  bus.connect();
  for (int i = 0; i < 1000; ++i) {
    bus.run_for(137);
    EXPECT_EQ(bus.master->listen_from_us(), INT64_MIN);
  }
}

}  // namespace
}  // namespace bushd::test
