// What another master has done to the MCUs of a line while it talked.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "daemon/lab.h"
#include "engine/frame.h"
#include "engine/message.h"

namespace bushd::test {
namespace {

// Frames of the other one, on the line before what the daemon sends.
class OtherMaster {
 public:
  explicit OtherMaster(Lab& lab) {
    lab.on_send = [this](std::size_t, std::vector<std::uint8_t>& bytes) {
      bytes.insert(bytes.begin(), wire_.begin(), wire_.end());
      wire_.clear();
      return true;
    };
  }
  void sync(std::uint32_t sync_id) {
    bushd_sync sync{};
    sync.master = 4711;
    sync.sync_id = sync_id;
    std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload{};
    send(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, 0, payload.data(),
         bushd_encode_sync(&sync, payload.data()));
  }
  void forget_tables() {
    const bushd_control control{.actions = BUSHD_CONTROL_FORGET_TABLES, .faults = 0};
    std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload{};
    const std::size_t size = bushd_encode_control(&control, payload.data());
    // Whatever the sequence of the daemon is, one of these is not behind it.
    for (const std::uint8_t sequence : std::array<std::uint8_t, 4>{60, 120, 180, 240}) {
      send(1, BUSHD_MSG_CONTROL, sequence, payload.data(), size);
    }
  }

 private:
  void send(std::uint8_t address, std::uint8_t type, std::uint8_t sequence,
            const std::uint8_t* payload, std::size_t size) {
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire{};
    const std::size_t n = bushd_frame_encode(address, type, sequence, payload, size, wire.data());
    wire_.insert(wire_.end(), wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(n));
  }

  std::vector<std::uint8_t> wire_;
};

TEST(TwoMasters, WhatTheOtherOneHasChangedIsSetUpAgain) {
  for (const char* manner : {"fine_table", "fine"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(hall(1, 1, manner));
    OtherMaster other(lab);
    other.sync(77);
    lab.run_for(0.2);
    other.sync(78);
    other.forget_tables();
    lab.run_for(0.2);
    ASSERT_EQ(lab.state_of("hall:1").detail, "another master talks on the bus");
    ASSERT_TRUE(lab.run_until([&] { return lab.state_of("hall:1").detail.empty(); }, 10));
    ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {500}).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), 500);
  }
}

}  // namespace
}  // namespace bushd::test
