// MCUs with clocks of their own, brought and kept in step by SYNC frames.
#include <gtest/gtest.h>

#include <cstdlib>

#include "bus_fixture.h"

namespace bushd::sim {
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
    Master master(bus);
    master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
    EXPECT_EQ(skew_ns(bus), 0) << "phase " << phase_ns;
    EXPECT_EQ(bus.mcu(0).core().tick, bus.mcu(1).core().tick);
  }
}

TEST(Sync, LateComerJoinsTheOthers) {
  Bus bus(500'000);
  bus.add_mcu({.address = 1});
  bus.add_mcu({.address = 2, .boot_ns = 123'456});
  Master master(bus);
  master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
  bus.advance_to(bus.now_ns() + 1'234'567'890);
  bus.reboot(1, 654'321);
  bus.advance_to(bus.now_ns() + 1'000'000);
  const bushd_configure configure{kTickNs, BUSHD_FORMAT_FINE, 1000};
  ASSERT_EQ(master.acknowledged(2, BUSHD_MSG_CONFIGURE, bushd_encode_configure, configure),
            BUSHD_OK);
  for (int i = 0; i < 4; ++i) {
    bus.advance_to(bus.now_ns() + 20'000'000);
    master.discipline(1);
  }
  bus.advance_to(bus.now_ns() + 20'000'000);
  EXPECT_TRUE(bus.mcu(1).core().flags & BUSHD_FLAG_SYNCED);
  EXPECT_EQ(skew_ns(bus), 0);
}

// A frame that an adapter sends twice, whenever, is one mark: the first, which the others heard
// too.
TEST(Sync, RepeatedFrameIsNoOtherMark) {
  Bus bus(500'000);
  bus.add_mcu({.address = 1});
  Master master(bus);
  master.bring_up(kTickNs, BUSHD_FORMAT_FINE);
  const auto mark_after = [&](TimeNs pause_ns, std::uint32_t name) {
    std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload;
    const bushd_sync message = {1, name, false, 0, 0, 0};
    bus.advance_to(bus.now_ns() + pause_ns);
    bus.master_send(Master::wire(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, 200,
                                 {payload.data(), bushd_encode_sync(&message, payload.data())}),
                    bus.now_ns());
    master.drain();
    return bus.mcu(0).core().clock.mark_tick;
  };
  const std::uint32_t first = mark_after(1'000'000, 1000);
  EXPECT_EQ(mark_after(0, 1000), first);
  EXPECT_EQ(mark_after(60'000'000, 1000), first);
  EXPECT_EQ(mark_after(60'000'000'000, 1000), first);
  EXPECT_GT(mark_after(1'000'000, 1001), first);
}

// Two crystals 100 ppm apart part by 50 us in the half second between two marks, and a mark's error
// is known at the next one: so twice that is the bound, for as long as it goes on. A correction is
// spread over several ticks where 1/64 of a tick is less.
TEST(Sync, ClocksThatDifferAreHeldTogether) {
  constexpr TimeNs kParting = 50'000;
  for (const std::uint32_t tick_ns : {500'000u, 1'000'000u, kTickNs, BUSHD_MAX_TICK_NS}) {
    for (const std::int32_t ppm : {50, -50}) {
      Bus bus(500'000);
      bus.add_mcu({.address = 1, .clock_ppm = ppm});
      bus.add_mcu({.address = 2, .boot_ns = 1'000'000, .clock_ppm = -ppm});
      Master master(bus);
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
      EXPECT_LT(worst_ns, 2 * kParting + kParting / 10) << "tick " << tick_ns << " ppm " << ppm;
      EXPECT_EQ(master.poll(2).faults, 0);
      EXPECT_EQ(bus.collisions(), 0u);
    }
  }
}

}  // namespace
}  // namespace bushd::sim
