#include "engine/message.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "engine/message_kinds.h"

namespace bushd::test::message_test {
namespace {

class Message : public testing::TestWithParam<std::string> {
 protected:
  const Kind& kind() const { return message_kinds().at(GetParam()); }
};

TEST_P(Message, EveryBitComesThrough) {
  holds(GetParam() + ": encode(decode(payload)) == payload", [this] {
    const Bytes payload = kind().valid();
    const Decoded decoded = kind().decode(payload);
    RC_ASSERT(decoded.status == BUSHD_OK);
    RC_ASSERT(decoded.out_of_range == "");
    RC_ASSERT(decoded.reencoded == payload);
  });
}

TEST_P(Message, RefusesEveryTruncationAndEveryByteTooMany) {
  holds(GetParam() + ": only the exact length is taken", [this] {
    Bytes payload = kind().valid();
    for (size_t size = 0; size < payload.size(); ++size) {
      const Bytes part(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(size));
      const Decoded decoded = kind().decode(part);
      if (kind().open_ended && decoded.status == BUSHD_OK) {
        RC_ASSERT(decoded.reencoded == part);
      } else if (!kind().open_ended || decoded.status != BUSHD_E_FORMAT) {
        RC_ASSERT(decoded.status == BUSHD_E_LENGTH);
      }
    }
    payload.push_back(*rc::gen::arbitrary<uint8_t>());
    RC_ASSERT(kind().decode(payload).status == BUSHD_E_LENGTH);
  });
}

TEST_P(Message, RefusesFieldsOutOfRange) {
  for (const auto& bad : kind().out_of_range) {
    holds(GetParam() + ": " + bad.what, [&] {
      Bytes payload = kind().valid();
      bad.spoil(&payload);
      RC_ASSERT(kind().decode(payload).status == BUSHD_E_FORMAT);
    });
  }
}

TEST_P(Message, SurvivesAnyPayload) {
  holds(GetParam() + ": any bytes decode to what is promised, or are refused", [this] {
    const Bytes payload = random_bytes(between<size_t>(1, BUSHD_FRAME_MAX_PAYLOAD));
    const Decoded decoded = kind().decode(payload);
    RC_ASSERT(decoded.status == BUSHD_OK || decoded.status == BUSHD_E_LENGTH ||
              decoded.status == BUSHD_E_FORMAT);
    RC_ASSERT(decoded.out_of_range == "");
  });
}

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : message_kinds()) names.push_back(name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Every, Message, testing::ValuesIn(kind_names()),
                         [](const auto& kind) { return kind.param; });

// Payloads that are as long as these fields say, so that only the range speaks against them.
TEST(MessageTicks, RefusesNoTicksAndNoMotors) {
  bushd_ticks message;
  Bytes payload(BUSHD_TICKS_HEADER + 2, 0);
  bushd_put_u16(payload.data() + 7, 1);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
  payload.resize(BUSHD_TICKS_HEADER);
  payload[6] = 1;
  bushd_put_u16(payload.data() + 7, 0);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTicks, RefusesTheFineDisplacementWithoutACounterpart) {
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  const uint16_t delay = 10;
  std::size_t size = bushd_encode_ticks_head(0, BUSHD_TICKS_FINE, 5, 2, 1, &delay, payload.data());
  bushd_put_i16(&payload[size], 7);
  bushd_put_i16(&payload[size + 2], INT16_MIN + 1);
  bushd_ticks ticks{};
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_OK);
  bushd_put_i16(&payload[size + 2], INT16_MIN);
  EXPECT_EQ(bushd_decode_ticks(payload.data(), size + 4, &ticks), BUSHD_E_FORMAT);
}

TEST(MessageControl, MayLeaveOutTheFaults) {
  for (unsigned actions = 0; actions <= UINT8_MAX; ++actions) {
    const Bytes payload{static_cast<uint8_t>(actions)};
    const Decoded decoded = message_kinds().at("control").decode(payload);
    const bool both = (actions & 3) == 3;
    ASSERT_EQ(decoded.status, actions < 16 && !both ? BUSHD_OK : BUSHD_E_FORMAT);
    if (decoded.status == BUSHD_OK) {
      EXPECT_EQ(decoded.reencoded, payload);
    }
  }
}

TEST(MessageTableTicks, RefusesMotorsThatDoNotRise) {
  holds("an order of motors is taken if it rises", [] {
    const std::vector<bushd_table_ticks_entry> entries{{between<uint8_t>(0, 15), any_run_state()},
                                                       {between<uint8_t>(0, 15), any_run_state()}};
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(bushd_encode_table_ticks(0, 0, 1, 1, entries.data(), 2, payload.data()));
    bushd_table_ticks message{};
    RC_ASSERT(bushd_decode_table_ticks(payload.data(), payload.size(), &message) ==
              (entries[0].motor < entries[1].motor ? BUSHD_OK : BUSHD_E_FORMAT));
  });
}

TEST(MessageTableTicks, RefusesAFieldOf0ThatNeedNotBeThere) {
  bushd_table_ticks_entry entry{5, {}};
  entry.state.direction = 1;
  entry.state.since_ns = 7;
  entry.state.lead_delay = 9;
  entry.state.decel_left = 1;
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()));
  bushd_table_ticks message{};
  EXPECT_EQ(bushd_decode_table_ticks(payload.data(), payload.size(), &message), BUSHD_OK);
  Bytes no_ns = payload;
  bushd_put_u32(&no_ns[BUSHD_TABLE_TICKS_HEADER + 3], 0);
  EXPECT_EQ(bushd_decode_table_ticks(no_ns.data(), no_ns.size(), &message), BUSHD_E_FORMAT);
  Bytes no_cruise = payload;
  no_cruise[1] |= BUSHD_TICKS_CRUISE;
  no_cruise.insert(no_cruise.begin() + BUSHD_TABLE_TICKS_HEADER + 3, {0, 0});
  EXPECT_EQ(bushd_decode_table_ticks(no_cruise.data(), no_cruise.size(), &message), BUSHD_E_FORMAT);
  Bytes no_lead = payload;
  bushd_put_u16(&no_lead[BUSHD_TABLE_TICKS_HEADER + 7], 0);
  EXPECT_EQ(bushd_decode_table_ticks(no_lead.data(), no_lead.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTableTicks, AMotorInCruiseTakesThreeBytes) {
  bushd_table_ticks_entry entry{5, {}};
  entry.state.direction = -1;
  entry.state.cruises = true;
  entry.state.since = 9;
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_EQ(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()),
            BUSHD_TABLE_TICKS_HEADER + 3);
}

TEST(MessageTableTicks, NoEntryIsLongerThanTheLongest) {
  const bushd_table_ticks_entry entry{15, {1, false, 9, 9, 9, 9, 9, 9, 9, 9}};
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_EQ(bushd_encode_table_ticks(1, 0, 1000, 190, &entry, 1, payload.data()),
            BUSHD_TABLE_TICKS_HEADER + BUSHD_TABLE_TICKS_MAX_ENTRY);
}

TEST(MessageTableRun, OfAllMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_TABLE_RUN_HEADER + BUSHD_TABLE_RUN_MAX_ENTRY * BUSHD_MOTORS_PER_MCU,
            BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(MessageLineRun, OfAllMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_LINE_RUN_HEADER + BUSHD_LINE_RUN_ENTRY * BUSHD_MOTORS_PER_MCU,
            BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(MessagePoll, RefusesToAskNobody) {
  bushd_poll message;
  const uint8_t nobody = 0;
  EXPECT_EQ(bushd_decode_poll(&nobody, 1, &message), BUSHD_E_FORMAT);
}

TEST(MessagePoll, TellsEachAddressItsWindow) {
  const std::vector<bushd_poll_entry> entries{
      {7, 50, 3, 22}, {1, 700, 0, 255}, {255, 65535, 255, 0}};
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_poll(entries.data(), 3, payload.data()));
  bushd_poll poll{};
  ASSERT_EQ(bushd_decode_poll(payload.data(), payload.size(), &poll), BUSHD_OK);
  for (const auto& expected : entries) {
    bushd_poll_entry entry{};
    ASSERT_TRUE(bushd_poll_find(&poll, expected.address, &entry));
    EXPECT_EQ(entry.address, expected.address);
    EXPECT_EQ(entry.begin_units, expected.begin_units);
    EXPECT_EQ(entry.known, expected.known);
    EXPECT_EQ(entry.room, expected.room);
  }
  bushd_poll_entry entry{};
  EXPECT_FALSE(bushd_poll_find(&poll, 2, &entry));
}

TEST(MessagePoll, TheMostEntriesFillAFrame) {
  EXPECT_LE(1 + 5 * BUSHD_POLL_MAX_ENTRIES, BUSHD_FRAME_MAX_PAYLOAD);
  EXPECT_GT(1 + 5 * (BUSHD_POLL_MAX_ENTRIES + 1), BUSHD_FRAME_MAX_PAYLOAD);
}

TEST(MessageIdentity, OfAnotherVersionTellsThatVersionAndNothingElse) {
  holds("any payload that begins with another version", [] {
    Bytes payload = random_bytes(between<size_t>(1, BUSHD_FRAME_MAX_PAYLOAD));
    RC_PRE(payload[0] != BUSHD_PROTOCOL_VERSION);
    bushd_identity identity{};
    RC_ASSERT(bushd_decode_identity(payload.data(), payload.size(), &identity) == BUSHD_OK);
    RC_ASSERT(identity.protocol_version == payload[0]);
    RC_ASSERT(identity.motors == 0 && identity.boot_number == 0 && identity.capabilities == 0);
  });
}

// MCUs that chose the same window must be able to get apart: another salt, other windows.
TEST(IdentifyWindow, AnySaltSpreadsTheMcusOverTheWindows) {
  constexpr uint8_t kWindows = 16;
  for (uint16_t salt = 0; salt < 50; ++salt) {
    std::vector<int> in_window(kWindows);
    for (int mcu = 0; mcu < 16 * kWindows; ++mcu) {
      const uint8_t id[BUSHD_UNIQUE_ID_SIZE] = {'b', 'u', 's', 'h',
                                                0,   0,   1,   static_cast<uint8_t>(mcu)};
      const uint8_t window = bushd_identify_window(id, salt, kWindows);
      ASSERT_LT(window, kWindows);
      ++in_window[window];
    }
    for (const int mcus : in_window) EXPECT_LT(mcus, 3 * 16) << "salt " << salt;
  }
}

TEST(IdentifyWindow, TwoMcusAreApartAfterFewSalts) {
  holds("some of 20 salts parts two ids", [] {
    const Bytes one = random_bytes(BUSHD_UNIQUE_ID_SIZE);
    const Bytes other = random_bytes(BUSHD_UNIQUE_ID_SIZE);
    RC_PRE(one != other);
    bool apart = false;
    for (uint16_t salt = 0; salt < 20; ++salt) {
      apart = apart || bushd_identify_window(one.data(), salt, 8) !=
                           bushd_identify_window(other.data(), salt, 8);
    }
    RC_ASSERT(apart);
  });
}

TEST(MessageTableData, RefusesNoCodesAndTooMany) {
  bushd_table_data message;
  EXPECT_EQ(bushd_decode_table_data(Bytes(4, 0).data(), 4, &message), BUSHD_E_FORMAT);
  Bytes payload(4 + 2 * 121, 1);
  payload[3] = 121;
  EXPECT_EQ(bushd_decode_table_data(payload.data(), payload.size(), &message), BUSHD_E_FORMAT);
}

TEST(MessageTicks, CapacityIsTheMostThatFitsAFrame) {
  for (uint8_t motors = 1; motors <= BUSHD_MOTORS_PER_MCU; ++motors) {
    for (const bool fine : {false, true}) {
      const size_t capacity = bushd_ticks_capacity(motors, fine);
      const size_t head = BUSHD_TICKS_HEADER + 2u * motors;
      const size_t row = (fine ? 2u : 1u) * motors;
      EXPECT_GE(capacity, 1u);
      EXPECT_LE(head + capacity * row, BUSHD_FRAME_MAX_PAYLOAD);
      EXPECT_GT(head + (capacity + 1) * row, BUSHD_FRAME_MAX_PAYLOAD);
    }
  }
}

TEST(MessageReport, OfSixteenMotorsFitsAFrame) {
  EXPECT_LE(BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU), BUSHD_FRAME_MAX_PAYLOAD);
}

bushd_report told_before() {
  bushd_report report{};
  report.motor_count = 3;
  report.inputs = 0x1234;
  report.sync_id = 77;
  report.running = 1;
  report.autonomous = 2;
  report.low_water_ticks = 9;
  report.out_of_order = 4;
  report.out_of_order_from = 5;
  report.out_of_order_until = 6;
  for (uint8_t m = 0; m < 3; ++m) report.motor[m] = {100 + m, static_cast<uint16_t>(7000 + m)};
  return report;
}

Bytes encoded(const bushd_report& report) {
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_report(&report, payload.data()));
  return payload;
}

TEST(MessageReport, WhatItDoesNotTellStaysButForMotion) {
  bushd_report news{};
  news.number = 9;
  news.sections = BUSHD_TELLS_INPUTS;
  news.motors = 2;
  news.tick = 70'000;
  news.inputs = 3;
  news.motor[1] = {-5, 4'500};
  bushd_report report = told_before();
  const Bytes payload = encoded(news);
  ASSERT_EQ(bushd_decode_report(payload.data(), payload.size(), &report), BUSHD_OK);
  EXPECT_EQ(report.number, 9);
  EXPECT_EQ(report.inputs, 3);
  EXPECT_EQ(report.sync_id, 77u);
  EXPECT_EQ(report.motor_count, 3);
  EXPECT_EQ(report.running | report.autonomous | report.out_of_order, 0);
  EXPECT_EQ(report.out_of_order_from | report.out_of_order_until, 0);
  EXPECT_EQ(report.low_water_ticks, 65'535);
  EXPECT_EQ(report.motor[0].position_steps, 100);
  EXPECT_EQ(report.motor[1].position_steps, -5);
  EXPECT_EQ(report.motor[2].position_steps, 102);
  EXPECT_EQ(report.motor[0].known_until, (70'000 + 2) & 0xFFFF);
  EXPECT_EQ(report.motor[1].known_until, 4'500);
  EXPECT_FALSE(bushd_report_is_whole(&report));
}

TEST(MessageReport, RefusesMotorsThatAreNotThere) {
  bushd_report news{};
  news.number = 9;
  news.motors = 8;
  bushd_report report = told_before();
  const Bytes payload = encoded(news);
  EXPECT_EQ(bushd_decode_report(payload.data(), payload.size(), &report), BUSHD_E_FORMAT);
  news.sections = BUSHD_TELLS_BOOT;
  news.motor_count = 17;
  const Bytes many = encoded(news);
  report = told_before();
  EXPECT_EQ(bushd_decode_report(many.data(), many.size(), &report), BUSHD_E_FORMAT);
}

TEST(MessageReport, IsWholeWithAllSectionsAndMotors) {
  bushd_report news{};
  news.number = 1;
  news.sections = BUSHD_TELLS_ALL;
  news.motors = 7;
  news.motor_count = 3;
  EXPECT_TRUE(bushd_report_is_whole(&news));
  for (const int bit : {1, 2, 4, 8, 16, 32}) {
    bushd_report part = news;
    part.sections = static_cast<uint8_t>(BUSHD_TELLS_ALL - bit);
    EXPECT_FALSE(bushd_report_is_whole(&part)) << bit;
  }
  news.motors = 3;
  EXPECT_FALSE(bushd_report_is_whole(&news));
}

TEST(MessageReport, HasTheSizeThatItsEncoderMakes) {
  holds("any sections and motors", [] {
    bushd_report report{};
    report.sections = between<uint8_t>(0, BUSHD_TELLS_ALL);
    report.motors = *rc::gen::arbitrary<uint16_t>();
    RC_ASSERT(bushd_report_size(report.sections, report.motors) == encoded(report).size());
  });
  EXPECT_EQ(bushd_report_size(BUSHD_TELLS_ALL, 0xFFFF), BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU));
}

TEST(Status, EveryCodeHasItsOwnText) {
  std::map<std::string, int> texts;
  for (unsigned code = 0; code <= BUSHD_E_STEP_PERIOD; ++code) ++texts[bushd_status_text(code)];
  EXPECT_EQ(texts.size(), BUSHD_E_STEP_PERIOD + 1u);
  EXPECT_EQ(texts.count("unknown status"), 0u);
  EXPECT_STREQ(bushd_status_text(BUSHD_E_STEP_PERIOD + 1), "unknown status");
  EXPECT_STREQ(bushd_status_text(255), "unknown status");
}

}  // namespace
}  // namespace bushd::test::message_test
