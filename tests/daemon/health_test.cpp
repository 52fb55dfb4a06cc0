// What the daemon tells of its buses' health, and of a second master on a line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "daemon/lab.h"
#include "engine/frame.h"
#include "engine/message.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

TEST(Health, OfAQuietBus) {
  ReadyLab lab(hall(2, 2));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {2000}).result, "reached");
  const api::HealthSnapshot health = lab.health_of("hall");
  EXPECT_EQ(health.port_state, "open");
  EXPECT_FALSE(health.two_masters);
  EXPECT_EQ(health.crc_errors, 0);
  EXPECT_EQ(health.line_bytes_per_s, 50'000);
  EXPECT_EQ(health.latency.back().below_us, INT64_MAX);
  std::uint64_t answers = 0;
  for (const auto& latency : health.latency) answers += latency.answers;
  EXPECT_GT(answers, 20u);
  ASSERT_EQ(health.mcus.size(), 2u);
  const api::McuHealth& mcu = health.mcus[0];
  EXPECT_EQ(mcu.mcu, "hall:1");
  EXPECT_EQ(mcu.unique_id.size(), 16u);
  EXPECT_NE(mcu.unique_id, health.mcus[1].unique_id);
  EXPECT_EQ(mcu.boot, 1);
  EXPECT_EQ(mcu.crc_errors + mcu.rejected_frames + mcu.ramp_downs + mcu.timeouts + mcu.repeats +
                mcu.missed_ticks + mcu.restarts,
            0);
}

TEST(Health, LostAndBrokenFramesShow) {
  ReadyLab lab(hall(1, 2, "fine_ticks"));
  lab.health_of("hall");
  unsigned writes = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    ++writes;
    if (writes % 7 == 0) bytes[bytes.size() / 2] ^= 4;
    return writes % 11 != 0;
  };
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {12000});
  lab.run_for(2);
  EXPECT_GE(lab.mcu_health("hall:1").low_water_ticks.value(), 0);
  EXPECT_EQ(lab.wait(move).result, "reached");
  lab.on_send = nullptr;
  const api::McuHealth mcu = lab.mcu_health("hall:1");
  EXPECT_GT(mcu.crc_errors, 0);
  EXPECT_GT(mcu.repeats, 0);
  EXPECT_GT(mcu.missed_ticks, 0);
  EXPECT_GT(mcu.timeouts, 0);
  lab.run_for(2);
  EXPECT_FALSE(lab.mcu_health("hall:1").low_water_ticks) << "none moved since the message before";
}

TEST(Health, ALostPortAndARestartShow) {
  ReadyLab lab(hall(1, 1));
  lab.unplug(0);
  EXPECT_THAT(lab.health_of("hall").port_state, HasSubstr("unplugged"));
  lab.plug(0);
  lab.connect();
  lab.bus(0).reboot(0);
  lab.run_for(1);
  EXPECT_EQ(lab.mcu_health("hall:1").restarts, 1);
}

TEST(TwoMasters, AreToldAndMovesRefusedWhileItLasts) {
  ReadyLab lab(hall(1, 1));
  // The other's SYNC frames reach the MCU between ours, now and then.
  std::uint32_t sync_id = 77;
  bool other = true;
  std::int64_t due_us = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    if (!other || lab.now_us() < due_us) return true;
    due_us = lab.now_us() + 300'000;
    bushd_sync sync{};
    sync.master = 4711;
    sync.sync_id = ++sync_id;
    std::array<std::uint8_t, 32> payload{};
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire{};
    const std::size_t size = bushd_encode_sync(&sync, payload.data());
    const std::size_t n = bushd_frame_encode(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, 1,
                                             payload.data(), size, wire.data());
    bytes.insert(bytes.begin(), wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(n));
    return true;
  };
  lab.run_for(3);
  EXPECT_EQ(lab.errors().size(), 1u) << "once";
  EXPECT_THAT(lab.errors().back(), HasSubstr("another master"));
  EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("another master"));
  const Answer refused = lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {5}));
  EXPECT_THAT(refused, Ends("refused", "another master talks on bus hall"));
  EXPECT_TRUE(lab.health_of("hall").two_masters);
  EXPECT_TRUE(lab.mcu_health("hall:1").two_masters);
  other = false;
  lab.run_for(5);
  EXPECT_FALSE(lab.health_of("hall").two_masters);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {5}).result, "reached");
}

}  // namespace
}  // namespace bushd::test
