// Answers in their windows, identities and addresses, masters that disturb each other, and what a
// report tells of the bus's health.
#include <algorithm>

#include "firmware/rig.h"

namespace bushd::test {
namespace {

Bytes poll_of(const std::vector<bushd_poll_entry>& entries) {
  return payload_of([&](std::uint8_t* to) {
    return bushd_encode_poll(entries.data(), static_cast<std::uint8_t>(entries.size()), to);
  });
}

Bytes identify_of(std::uint16_t salt, std::uint8_t windows, std::uint16_t units) {
  const bushd_identify message = {salt, windows, units};
  return payload_of(message, bushd_encode_identify);
}

Bytes address_of(std::array<std::uint8_t, BUSHD_UNIQUE_ID_SIZE> id, std::uint8_t address) {
  Bytes payload(id.begin(), id.end());
  payload.push_back(address);
  return payload;
}

TEST(Requests, PollIsAnsweredInTheWindowThatItNames) {
  Rig rig({.address = 7});
  rig.frame(0, BUSHD_MSG_POLL, poll_of({{3, 50, 0, 255}, {7, 1234, 0, 255}, {9, 5000, 0, 255}}));
  const auto got = rig.answer();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->type, BUSHD_MSG_POLL);
  EXPECT_EQ(got->delay_ns, 12'340'000u);
  rig.frame(0, BUSHD_MSG_POLL, poll_of({{7, 0, 0, 255}}));
  EXPECT_EQ(rig.answer()->delay_ns, 0u);
  rig.frame(0, BUSHD_MSG_POLL, poll_of({{3, 50, 0, 255}, {9, 5000, 0, 255}}));
  EXPECT_FALSE(rig.answer()) << "not named";
  rig.frame(0, BUSHD_MSG_POLL, {});
  rig.frame(0, BUSHD_MSG_POLL, {2, 7, 0, 0});
  EXPECT_FALSE(rig.answer());
  EXPECT_EQ(rig.poll().rejected_frames, 2);
}

TEST(Requests, IdentityComesInTheWindowOfUniqueIdAndSalt) {
  Rig rig({.address = 7});
  const auto id = Rig::unique_id();
  for (const auto address : std::initializer_list<std::uint8_t>{0, 7}) {
    for (std::uint16_t salt = 0; salt < 100; ++salt) {
      rig.frame(address, BUSHD_MSG_IDENTIFY, identify_of(salt, 16, 200));
      const auto got = rig.answer();
      ASSERT_TRUE(got);
      EXPECT_EQ(got->delay_ns, bushd_identify_window(id.data(), salt, 16) * 2'000'000u);
      EXPECT_EQ(got->payload[0], BUSHD_PROTOCOL_VERSION);
    }
  }
  rig.frame(0, BUSHD_MSG_IDENTIFY, identify_of(5, 1, 60000));
  EXPECT_EQ(rig.answer()->delay_ns, 0u) << "one window: at once";
  rig.frame(8, BUSHD_MSG_IDENTIFY, identify_of(5, 1, 0));
  EXPECT_FALSE(rig.answer());
}

// No port can wait for minutes, and no 32 bits of ns can tell it.
TEST(Requests, WindowSecondsAwayIsNotAnswered) {
  Rig rig;
  const auto id = Rig::unique_id();
  std::uint16_t salt = 0;
  while (bushd_identify_window(id.data(), salt, 255) < 100) ++salt;
  rig.frame(0, BUSHD_MSG_IDENTIFY, identify_of(salt, 255, 65535));
  EXPECT_FALSE(rig.answer());
  EXPECT_EQ(rig.poll().last_rejection, BUSHD_E_FORMAT);
}

TEST(Requests, AddressIsSetByUniqueIdAndKept) {
  Rig rig({.address = 7});
  auto other = Rig::unique_id();
  other[7] ^= 1;
  rig.frame(0, BUSHD_MSG_SET_ADDRESS, address_of(other, 20));
  EXPECT_FALSE(rig.answer());
  EXPECT_EQ(rig.stored_address(), -1);
  EXPECT_EQ(rig.poll().rejected_frames, 0) << "meant for another";
  rig.frame(0, BUSHD_MSG_SET_ADDRESS, address_of(Rig::unique_id(), 20));
  auto got = rig.answer();  // which checks that it comes from the new address
  ASSERT_TRUE(got);
  EXPECT_EQ(got->payload, Bytes{BUSHD_OK});
  EXPECT_EQ(rig.stored_address(), 20);
  rig.frame(7, BUSHD_MSG_TABLES, {});
  EXPECT_FALSE(rig.answer());
  rig.frame(20, BUSHD_MSG_TABLES, {});
  EXPECT_TRUE(rig.answer());
  rig.frame(0, BUSHD_MSG_SET_ADDRESS, address_of(Rig::unique_id(), 0));
  EXPECT_FALSE(rig.answer()) << "the broadcast address is nobody's";
}

TEST(Requests, AddressStaysWhileAMotorMovesAndWhereItCannotBeKept) {
  for (const bool stores : {true, false}) {
    ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE, {.stores_address = stores});
    if (stores) {
      ASSERT_EQ(rig.start(ramp_law(), 5), BUSHD_OK);
    }
    rig.frame(0, BUSHD_MSG_SET_ADDRESS, address_of(Rig::unique_id(), 20));
    const auto got = rig.answer();
    ASSERT_TRUE(got);
    EXPECT_EQ(got->payload, Bytes{BUSHD_E_STATE});
    EXPECT_EQ(rig.mcu().config.address, rig.options().address);
    EXPECT_EQ(rig.stored_address(), -1);
  }
}

TEST(Requests, AnotherSilenceAloneKeepsStepAndTables) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, Rig::kTickNs, 12), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  ASSERT_EQ(rig.start(ramp_law(), 5), BUSHD_OK);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, Rig::kTickNs, 20), BUSHD_OK) << "in motion too";
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(0), 5);
}

TEST(Requests, ATickThatIsTooShortForTheMcuIsRefused) {
  RigOptions options;
  options.min_tick_ns = Rig::kTickNs;
  Rig rig(options);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, Rig::kTickNs), BUSHD_OK);
  EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE, Rig::kTickNs - 1), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.mcu().tick_ns, Rig::kTickNs);
}

class TwoMasters : public testing::Test {
 protected:
  TwoMasters() { EXPECT_EQ(rig.configure(BUSHD_FORMAT_FINE), BUSHD_OK); }
  void sync_of(std::uint16_t master) { rig.sync({master, ++sync_id_, false, 0, 0, 0}); }
  bool told() { return (rig.poll().flags & BUSHD_FLAG_TWO_MASTERS) != 0; }
  static constexpr int kTwoSeconds = 2'000'000'000 / static_cast<int>(Rig::kTickNs);
  Rig rig;

 private:
  std::uint32_t sync_id_ = 100;
};

TEST_F(TwoMasters, ThatTakeTurnsAreToldUntilTwoSecondsAfter) {
  sync_of(1);
  rig.pass(300);
  sync_of(2);
  EXPECT_FALSE(told()) << "a master that has come after another";
  rig.pass(300);
  sync_of(2);
  EXPECT_FALSE(told());
  sync_of(1);
  EXPECT_TRUE(told());
  rig.pass(kTwoSeconds - 1);
  EXPECT_TRUE(told());
  rig.pass(2);
  EXPECT_FALSE(told());
}

TEST_F(TwoMasters, OneAfterTheOtherAreNoTrouble) {
  sync_of(1);
  rig.pass(10);
  sync_of(2);
  rig.pass(kTwoSeconds + 1);
  sync_of(1);
  EXPECT_FALSE(told()) << "it was silent for more than two seconds";
  sync_of(3);
  EXPECT_FALSE(told());
}

TEST(Requests, LowWaterIsThatOfMovingMotorsSinceTheReportBefore) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE);
  const Plan plan = plan_move(ramp_law(), 100, Rig::kTickNs, BUSHD_FORMAT_FINE);
  static_cast<void>(rig.poll());
  rig.pass(5);
  EXPECT_EQ(rig.poll().low_water_ticks, 65535) << "none moves";
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(rig.part(plan, start, 0, 40)), BUSHD_OK);
  static_cast<void>(rig.poll());
  rig.pass(10);
  EXPECT_EQ(rig.poll().low_water_ticks, 30);
  rig.pass(20);
  ASSERT_EQ(rig.take(rig.part(plan, start, 40, 40)), BUSHD_OK);
  rig.pass();
  EXPECT_EQ(rig.poll().low_water_ticks, 49) << "take() has asked for the lower one";
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().ramp_downs, 1);
}

}  // namespace
}  // namespace bushd::test
