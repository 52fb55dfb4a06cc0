// The port by itself: its clock, its edges, reset. The core behind it is the real one.
#include <gtest/gtest.h>

#include <vector>

#include "firmware/ports/virtual/virtual.h"

namespace {

constexpr std::int64_t kBootTickNs = BUSHD_BOOT_TICK_NS;

struct Rig {
  explicit Rig(std::int32_t clock_ppm = 0, std::int64_t boot_ns = 0) {
    bushd_virtual_config config{};
    config.mcu.address = 1;
    config.mcu.motors = 16;
    config.mcu.slots = 256;
    config.mcu.boot_number = 7;
    config.mcu.queue = queue.data();
    config.mcu.queue_ticks = 64;
    config.mcu.codes = codes.data();
    config.mcu.code_count = static_cast<std::uint16_t>(codes.size());
    config.boot_ns = boot_ns;
    config.clock_ppm = clock_ppm;
    config.turnaround_ns = 20'000;
    config.context = this;
    config.transmit = [](void* context, std::int64_t start_ns, const std::uint8_t* wire,
                         std::size_t size) {
      auto& rig = *static_cast<Rig*>(context);
      rig.sent_at_ns = start_ns;
      rig.sent.assign(wire, wire + size);
    };
    bushd_virtual_init(&port, &config);
  }

  void identify(std::int64_t end_ns, std::uint16_t window_units = 0) {
    std::uint8_t wire[BUSHD_FRAME_MAX_WIRE];
    // The second one of two windows.
    bushd_identify message = {0, 2, window_units};
    while (bushd_identify_window(port.config.mcu.unique_id, message.salt, 2) != 1) ++message.salt;
    std::uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
    const std::size_t size = bushd_frame_encode(1, BUSHD_MSG_IDENTIFY, 3, payload,
                                                bushd_encode_identify(&message, payload), wire);
    for (std::size_t i = 0; i < size; ++i) {
      bushd_virtual_receive(&port, wire[i], end_ns - static_cast<std::int64_t>(size - 1 - i) * 10);
    }
  }

  std::vector<std::int16_t> queue = std::vector<std::int16_t>(64 * 16);
  std::vector<std::uint16_t> codes = std::vector<std::uint16_t>(256);
  std::int64_t sent_at_ns = -1;
  std::vector<std::uint8_t> sent;
  bushd_virtual port;
};

TEST(VirtualPort, TicksFromBootOn) {
  Rig rig(0, 500);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), 500);
  bushd_virtual_advance(&rig.port, 499);
  EXPECT_FALSE(rig.port.running);
  bushd_virtual_advance(&rig.port, 500);
  EXPECT_TRUE(rig.port.running);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), 500 + kBootTickNs);
  bushd_virtual_advance(&rig.port, 500 + 3 * kBootTickNs - 1);
  EXPECT_EQ(rig.port.mcu.tick, 2u);
  bushd_virtual_advance(&rig.port, 500 + 3 * kBootTickNs);
  EXPECT_EQ(rig.port.mcu.tick, 3u);
}

TEST(VirtualPort, FastAndSlowClocksTickAtTheirOwnRateWithoutDrift) {
  // After an hour of true time, a clock that is 100 ppm fast has gone 0.36 s ahead, to the ns.
  const std::int64_t hour_ns = 3'600'000'000'000;
  for (const std::int32_t ppm : {100, -100, 1, -BUSHD_VIRTUAL_MAX_PPM}) {
    Rig rig(ppm);
    bushd_virtual_advance(&rig.port, hour_ns);
    const std::int64_t own_ns = hour_ns + hour_ns / 1'000'000 * ppm;
    EXPECT_EQ(rig.port.mcu.tick, own_ns / kBootTickNs) << ppm;
  }
}

TEST(VirtualPort, BoundaryIsTheFirstNanosecondThatReachesIt) {
  for (const std::int32_t ppm : {333, -333}) {
    Rig rig(ppm);
    bushd_virtual_advance(&rig.port, 0);
    for (int i = 0; i < 1000; ++i) {
      const std::int64_t boundary_ns = bushd_virtual_next_event_ns(&rig.port);
      bushd_virtual_advance(&rig.port, boundary_ns - 1);
      ASSERT_EQ(rig.port.mcu.tick, static_cast<std::uint32_t>(i));
      bushd_virtual_advance(&rig.port, boundary_ns);
      ASSERT_EQ(rig.port.mcu.tick, static_cast<std::uint32_t>(i) + 1);
      // A clock that is fast may step over its boundary, but by no more than one of its own ns.
      const bushd_port& io = rig.port.mcu.port;
      ASSERT_LE(io.time_in_tick_ns(io.context), 1u);
    }
  }
}

TEST(VirtualPort, AdjustedTickIsLongerOnceAndOnlyOnce) {
  Rig rig;
  bushd_virtual_advance(&rig.port, 10);
  const bushd_port& io = rig.port.mcu.port;
  EXPECT_EQ(io.time_in_tick_ns(io.context), 10u);
  io.adjust_tick(io.context, 700);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), kBootTickNs);
  bushd_virtual_advance(&rig.port, kBootTickNs);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), 2 * kBootTickNs + 700);
  bushd_virtual_advance(&rig.port, 2 * kBootTickNs + 700);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), 3 * kBootTickNs + 700);
}

TEST(VirtualPort, NewTickLengthHoldsFromTheNextBoundaryOn) {
  Rig rig;
  bushd_virtual_advance(&rig.port, 10);
  const bushd_port& io = rig.port.mcu.port;
  io.set_tick(io.context, 1'000'000);
  bushd_virtual_advance(&rig.port, kBootTickNs);
  EXPECT_EQ(bushd_virtual_next_event_ns(&rig.port), kBootTickNs + 1'000'000);
}

TEST(VirtualPort, AnswersOneTurnaroundAfterTheRequest) {
  Rig rig;
  rig.identify(1'000'000);
  EXPECT_EQ(rig.sent_at_ns, 1'020'000);
  EXPECT_FALSE(rig.sent.empty());
}

TEST(VirtualPort, AnswersInItsWindowIfThatIsLaterThanTheTurnaround) {
  Rig rig;
  rig.identify(1'000'000, 1);
  EXPECT_EQ(rig.sent_at_ns, 1'020'000);
  rig.identify(2'000'000, 300);
  EXPECT_EQ(rig.sent_at_ns, 5'000'000);
}

TEST(VirtualPort, KeepsItsAddressOverAReset) {
  Rig rig;
  bushd_virtual_advance(&rig.port, 0);
  const bushd_port& io = rig.port.mcu.port;
  EXPECT_TRUE(io.store_address(io.context, 9));
  bushd_virtual_reset(&rig.port, 5'000'000, 6'000'000, 8);
  bushd_virtual_advance(&rig.port, 6'000'000);
  EXPECT_EQ(rig.port.mcu.config.address, 9);
}

TEST(VirtualPort, DeafInResetAndAnotherBootNumberAfterIt) {
  Rig rig;
  bushd_virtual_reset(&rig.port, 5'000'000, 6'000'000, 8);
  rig.identify(5'999'999);
  EXPECT_TRUE(rig.sent.empty());
  rig.identify(7'000'000);
  ASSERT_FALSE(rig.sent.empty());
  EXPECT_EQ(rig.port.mcu.config.boot_number, 8);
  EXPECT_EQ(rig.port.mcu.tick, 0u);
}

TEST(VirtualPort, FailedSelfTestShowsAsFault) {
  Rig rig;
  rig.port.failing_tests = BUSHD_TEST_FLASH;
  bushd_virtual_advance(&rig.port, 0);
  EXPECT_EQ(rig.port.mcu.faults, BUSHD_FAULT_SELF_TEST);
}

}  // namespace
