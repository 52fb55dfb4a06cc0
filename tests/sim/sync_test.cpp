// MCUs with clocks of their own, brought and kept in step by SYNC frames.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <utility>

#include "bus_fixture.h"

namespace bushd::sim::sync_test {
namespace {

constexpr std::uint32_t kTickNs = 2'560'000;

// How far the second MCU's ticks begin after those of the first, in true time.
TimeNs skew_ns(const Bus& bus, std::uint32_t tick_ns = kTickNs) {
  const bushd_mcu& a = bus.mcu(0).core();
  const bushd_mcu& b = bus.mcu(1).core();
  const auto ticks = static_cast<std::int32_t>(b.tick - a.tick);
  return bus.mcu(1).next_event_ns() - bus.mcu(0).next_event_ns() - TimeNs{ticks} * tick_ns;
}

TEST(Sync, PerfectClocksOfAnyPhaseTickAtTheSameNanosecond) {
  for (const TimeNs phase_ns : {TimeNs{1}, TimeNs{333'333}, TimeNs{1'280'000}, TimeNs{2'559'999}}) {
    Bus bus(500'000);
    bus.add_mcu({.address = 1});
    bus.add_mcu({.address = 2, .boot_ns = phase_ns});
    FrameMaster master(bus);
    master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
    EXPECT_EQ(skew_ns(bus), 0) << "phase " << phase_ns;
    EXPECT_EQ(bus.mcu(0).core().tick, bus.mcu(1).core().tick);
  }
}

TEST(Sync, LateComerJoinsTheOthers) {
  Bus bus(500'000);
  bus.add_mcu({.address = 1});
  bus.add_mcu({.address = 2, .boot_ns = 123'456});
  FrameMaster master(bus);
  master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
  bus.advance_to(bus.now_ns() + 1'234'567'890);
  bus.reboot(1, 654'321);
  bus.advance_to(bus.now_ns() + 1'000'000);
  const bushd_configure configure{kTickNs, BUSHD_FORMAT_FINE, 1000};
  ASSERT_EQ(master.acknowledged(2, configure), BUSHD_OK);
  for (int i = 0; i < 4; ++i) {
    bus.advance_to(bus.now_ns() + 20'000'000);
    master.discipline(1);
  }
  bus.advance_to(bus.now_ns() + 20'000'000);
  EXPECT_TRUE(bus.mcu(1).core().flags & BUSHD_FLAG_SYNCED);
  EXPECT_EQ(skew_ns(bus), 0);
}

// A frame that an adapter sends twice, whenever, is one SYNC: the first, which the others heard
// too.
TEST(Sync, RepeatedFrameIsNoOtherMark) {
  Bus bus(500'000);
  bus.add_mcu({.address = 1});
  FrameMaster master(bus);
  master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
  const auto mark_after = [&](TimeNs pause_ns, std::uint32_t name) {
    const test::Request sync = test::request_of(bushd_sync{1, name, false, 0, 0, 0});
    bus.advance_to(bus.now_ns() + pause_ns);
    bus.master_send(FrameMaster::wire(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, 200, sync.payload),
                    bus.now_ns());
    master.drain();
    return bus.mcu(0).core().clock.sync_tick;
  };
  const std::uint32_t first = mark_after(1'000'000, 1000);
  EXPECT_EQ(mark_after(0, 1000), first);
  EXPECT_EQ(mark_after(60'000'000, 1000), first);
  EXPECT_EQ(mark_after(60'000'000'000, 1000), first);
  EXPECT_GT(mark_after(1'000'000, 1001), first);
}

// Two crystals 100 ppm apart part by 50 us in the half second between two SYNC frames, until the
// rate is known; then by no more than a tick's correction. A correction is spread over several
// ticks where 1/64 of a tick is less.
TEST(Sync, ClocksThatDifferAreHeldTogether) {
  for (const std::uint32_t tick_ns : {500'000u, 1'000'000u, kTickNs, BUSHD_MAX_TICK_NS}) {
    for (const std::int32_t ppm : {50, -50}) {
      Bus bus(500'000);
      bus.add_mcu({.address = 1, .clock_ppm = ppm});
      bus.add_mcu({.address = 2, .boot_ns = 1'000'000, .clock_ppm = -ppm});
      FrameMaster master(bus);
      master.bring_up(tick_ns, BUSHD_FORMAT_FINE);
      TimeNs worst_ns = 0;
      for (int i = 0; i < 600; ++i) {
        master.discipline(1);
        const TimeNs next_mark_ns = bus.now_ns() + 490'000'000;
        while (bus.now_ns() < next_mark_ns) {
          if (i > 4) worst_ns = std::max(worst_ns, std::abs(skew_ns(bus, tick_ns)));
          bus.advance_to(std::min(next_mark_ns, bus.now_ns() + 50'000'000));
        }
        if (i > 4) worst_ns = std::max(worst_ns, std::abs(skew_ns(bus, tick_ns)));
      }
      EXPECT_LT(worst_ns, 2'000) << "tick " << tick_ns << " ppm " << ppm;
      EXPECT_EQ(master.poll(2).faults, 0);
      EXPECT_EQ(bus.collisions(), 0u);
    }
  }
}

// A master that keeps two MCUs together over a line that loses SYNC frames: each MCU by itself
// misses 30 % of them, and now and then all are lost for 10 s. One of them is the reference.
class Hour {
 public:
  Hour(std::int32_t ppm_a, std::int32_t ppm_b, std::uint32_t tick_ns)
      : tick_ns_(tick_ns), bus_(500'000), master_(bus_) {
    bus_.add_mcu({.address = 1, .clock_ppm = ppm_a});
    bus_.add_mcu({.address = 2, .boot_ns = 777'777, .clock_ppm = ppm_b});
    master_.bring_up(tick_ns, BUSHD_FORMAT_FINE);
  }
  void refer_to(std::uint8_t address) { reference_ = address; }
  // The first MCU has lost its time and its rate, and joins the second.
  void reboot_first(int syncs = 2) {
    bus_.reboot(0);
    bus_.advance_to(bus_.now_ns() + 100'000'000);
    const bushd_configure configure{tick_ns_, BUSHD_FORMAT_FINE, 1000};
    ASSERT_EQ(master_.acknowledged(1, configure), BUSHD_OK);
    for (int i = 0; i < syncs; ++i) {
      bus_.advance_to(bus_.now_ns() + 60'000'000);
      master_.discipline(2);
    }
    ASSERT_NE(master_.poll(1).flags & BUSHD_FLAG_SYNCED, 0);
  }
  void silence(TimeNs length_ns) {
    const TimeNs end_ns = bus_.now_ns() + length_ns;
    while (bus_.now_ns() < end_ns) {
      bus_.advance_to(std::min(end_ns, bus_.now_ns() + 20'000'000));
      if (measured_) worst_ns_ = std::max(worst_ns_, std::abs(skew_ns(bus_, tick_ns_)));
    }
  }
  // Half a second, with a SYNC at its end.
  void half_second(bool loss) { until_sync(500'000'000, loss); }
  void until_sync(TimeNs length_ns, bool loss) {
    const TimeNs sync_ns = bus_.now_ns() + length_ns;
    while (bus_.now_ns() < sync_ns) {
      bus_.advance_to(std::min(sync_ns, bus_.now_ns() + 20'000'000));
      if (measured_) worst_ns_ = std::max(worst_ns_, std::abs(skew_ns(bus_, tick_ns_)));
    }
    if (loss && silent_ == 0 && random_() % 200 == 0) silent_ = 20;
    if (silent_ > 0) {
      --silent_;
      return;
    }
    const bushd_report report = master_.poll(reference_);
    for (std::size_t i = 0; i < 2; ++i) {
      if (loss && random_() % 10 < 3) bus_.deafen(i, bus_.now_ns() + 3'000'000);
    }
    const bool known = (report.flags & BUSHD_FLAG_SYNC_HEARD) != 0;
    master_.sync({0, 0, known, report.sync_id, report.sync_tick, report.sync_ns});
  }
  void measure() { measured_ = true; }
  TimeNs worst_ns() const { return worst_ns_; }
  bushd_report report(std::uint8_t address) { return master_.poll(address); }

 private:
  std::uint32_t tick_ns_;
  Bus bus_;
  FrameMaster master_;
  std::uint8_t reference_ = 1;
  std::mt19937 random_{20260401};
  int silent_ = 0;
  bool measured_ = false;
  TimeNs worst_ns_ = 0;
};

TEST(Sync, CrystalsApartByHundredPpmKeepTogetherForAnHourThroughLostFrames) {
  for (const auto& [a, b] : {std::pair{50, -50}, {-50, 50}, {50, 0}}) {
    Hour hour(a, b, kTickNs);
    for (int i = 0; i < 10; ++i) hour.half_second(false);
    hour.measure();
    for (int i = 0; i < 7200; ++i) hour.half_second(true);
    EXPECT_LT(hour.worst_ns(), 20'000) << a << ' ' << b;
    const bushd_report second = hour.report(2);
    EXPECT_EQ(second.faults, 0);
    // How much faster than its own crystal, to count as the other does.
    const double expected_ppb = ((1e6 + a) / (1e6 + b) - 1) * 1e9;
    EXPECT_NEAR(second.rate_ppb, expected_ppb, 100);
    EXPECT_EQ(hour.report(1).rate_ppb, 0) << "the reference keeps its own";
  }
}

// It knows nothing of the rate that all the others have, and then the bus has another one.
TEST(Sync, ReferenceThatJoinedLaterIsFollowedWithinThreeSeconds) {
  for (const std::int32_t ppm : {50, -50, 4}) {
    Hour hour(ppm, -ppm, kTickNs);
    hour.refer_to(2);
    for (int i = 0; i < 10; ++i) hour.half_second(false);
    hour.reboot_first();
    hour.refer_to(1);
    for (int i = 0; i < 6; ++i) hour.half_second(false);
    hour.measure();
    hour.silence(10'000'000'000);
    EXPECT_LT(hour.worst_ns(), 20'000) << ppm;
  }
}

// A reference is told its own times, without an error. That is no estimate of its rate: what it
// hears first of another reference is, also where the SYNC frames lie close together.
TEST(Sync, ReferenceThatFollowsAnotherTakesItsRateAtOnce) {
  for (const std::int32_t ppm : {5, 8, -8, 20}) {
    Hour hour(ppm, -ppm, kTickNs);
    hour.refer_to(2);
    for (int i = 0; i < 4; ++i) hour.half_second(false);
    hour.reboot_first();
    hour.refer_to(1);
    for (int i = 0; i < 3; ++i) hour.until_sync(60'000'000, false);
    hour.measure();
    hour.silence(10'000'000'000);
    EXPECT_LT(hour.worst_ns(), 20'000) << ppm;
  }
}

// A daemon that stands still just after an MCU has come into step: its rate was estimated from
// SYNC frames that lie close together.
TEST(Sync, FirstEstimateOfTheRateHoldsThroughSilence) {
  for (const std::int32_t ppm : {14, -14, 50, -50}) {
    Hour hour(ppm, -ppm, kTickNs);
    hour.refer_to(2);
    for (int i = 0; i < 4; ++i) hour.half_second(false);
    hour.reboot_first(4);
    hour.measure();
    hour.silence(3'000'000'000);
    EXPECT_LT(hour.worst_ns(), 20'000) << ppm;
  }
}

// Also where ticks are short or long: a tick's share of the rate is no whole number of ns.
TEST(Sync, RateHoldsForAllTickLengths) {
  for (const std::uint32_t tick_ns : {BUSHD_MIN_TICK_NS, 1'000'000u, BUSHD_MAX_TICK_NS}) {
    Hour hour(50, -50, tick_ns);
    for (int i = 0; i < 10; ++i) hour.half_second(false);
    hour.measure();
    for (int i = 0; i < 400; ++i) hour.half_second(true);
    EXPECT_LT(hour.worst_ns(), 20'000) << tick_ns;
  }
}

}  // namespace
}  // namespace bushd::sim::sync_test
