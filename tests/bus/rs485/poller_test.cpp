// Whose turn it is, in which windows, and what becomes of those who do not answer.
#include "bus/rs485/poller.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "bus/rs485/machines.h"

namespace bushd::test {
namespace {

using testing::Each;
using testing::ElementsAre;

struct Nobody : link::Transactions::Listener {
  bool answered(std::int64_t, const link::Transactions::Answer&) override { return true; }
  bool unanswered(std::int64_t, McuIndex, std::uint8_t) override { return true; }
  void ended(std::int64_t, McuIndex, std::uint8_t) override {}
  void overheard(std::int64_t, const bushd_frame&) override {}
};

class Polling : public testing::Test {
 protected:
  explicit Polling(std::size_t count = 4) : mcus(online_mcus(count)) {}

  // The addresses asked by the last poll, and when their windows begin.
  std::vector<int> asked() {
    std::vector<int> addresses;
    begins_us.clear();
    known.clear();
    room.clear();
    for (const Sent& frame : take_sent(writer)) {
      EXPECT_EQ(frame.type, BUSHD_MSG_POLL);
      EXPECT_EQ(frame.address, link::kBroadcast);
      for (std::size_t i = 1; i + 4 < frame.payload.size(); i += 5) {
        addresses.push_back(frame.payload[i]);
        begins_us.push_back(bushd_get_u16(&frame.payload[i + 1]) * 10);
        known.push_back(frame.payload[i + 3]);
        room.push_back(frame.payload[i + 4]);
      }
    }
    transactions.abandon();
    return addresses;
  }
  std::int64_t frame_us(std::size_t entries) const {
    return writer.line_us(2 + 5 * entries + BUSHD_FRAME_OVERHEAD);
  }

  // Turns begin at multiples of 5 ms, so that those of many buses come together.
  static std::int64_t turn_after(std::int64_t sent_us) {
    return (sent_us + 50'000) / 5'000 * 5'000;
  }

  PerMcu<McuRecord> mcus;
  link::FrameWriter writer{kBaud};
  Nobody nobody;
  link::Transactions transactions{writer, nobody};
  link::Poller poller{mcus, transactions, writer};
  std::vector<int> begins_us;
  std::vector<int> known;
  std::vector<int> room;
};

TEST_F(Polling, AllAreAskedByOneFrame) {
  ASSERT_TRUE(poller.send_due(1'000'000));
  EXPECT_TRUE(transactions.open());
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4));
  // 10 + 82 + 6 bytes for each motor at 20 us, and the guard: 500 us and a byte.
  const int slot_us = begins_us[1] - begins_us[0];
  EXPECT_GE(begins_us[0], 1'000);
  EXPECT_GE(slot_us, (BUSHD_FRAME_OVERHEAD + 1 + int{BUSHD_REPORT_SIZE(4)}) * 20 + 520);
  EXPECT_EQ(poller.due_us(kFirst), 1'050'000);
  EXPECT_FALSE(poller.send_due(1'049'999));
  EXPECT_TRUE(poller.send_due(1'050'000));
}

TEST_F(Polling, WantedOneIsAskedAtOnceAndFirst) {
  poller.send_due(1'000'000);
  asked();
  EXPECT_FALSE(poller.send_wanted(1'010'000));
  mcus[McuIndex{2}].poll_wanted = true;
  ASSERT_TRUE(poller.send_wanted(1'010'000));
  EXPECT_THAT(asked(), ElementsAre(3)) << "the turn of the others is 40 ms off";
  EXPECT_FALSE(mcus[McuIndex{2}].poll_wanted);
  mcus[McuIndex{3}].poll_wanted = true;
  ASSERT_TRUE(poller.send_wanted(1'030'000));
  EXPECT_THAT(asked(), ElementsAre(4, 1, 2)) << "those whose turn comes soon are asked along";
}

// The frame arrives when there is news.
TEST_F(Polling, NewsIsAskedForWhenItComes) {
  poller.send_due(1'000'000);
  asked();
  poller.expect_news(kSecond, 1'012'345);
  const std::int64_t due_us = 1'012'345 - frame_us(1);
  EXPECT_EQ(poller.due_us(kSecond), due_us);
  EXPECT_FALSE(poller.send_due(due_us - 1));
  ASSERT_TRUE(poller.send_due(due_us));
  EXPECT_THAT(asked(), ElementsAre(2));
  EXPECT_EQ(poller.due_us(kSecond), turn_after(due_us)) << "a routine poll next";
  poller.expect_news(kFirst, 1'070'000);
  EXPECT_EQ(poller.due_us(kFirst), 1'050'000) << "no routine poll is later for it";
}

TEST_F(Polling, ExtraPollsLeaveTheLineToOthers) {
  poller.send_due(1'000'000);
  asked();
  poller.expect_news(kFirst, 1'010'000);
  poller.expect_news(kSecond, 1'013'001);
  ASSERT_TRUE(poller.send_due(1'010'000));
  EXPECT_THAT(asked(), ElementsAre(1));
  // The patience with an answer is 40 ms now: half of the time is that of the routine polls.
  EXPECT_EQ(poller.due_us(kSecond), 1'050'000);
  poller.ended(1'014'000);
  EXPECT_EQ(poller.due_us(kSecond), 1'018'000) << "as long as it took";
  ASSERT_TRUE(poller.send_due(1'018'000));
  EXPECT_THAT(asked(), ElementsAre(2));
}

TEST_F(Polling, NewsOfSeveralIsAskedForByOnePoll) {
  poller.send_due(1'000'000);
  asked();
  poller.expect_news(kFirst, 1'010'000);
  poller.expect_news(kSecond, 1'013'000);
  poller.expect_news(McuIndex{2}, 1'014'000);
  const std::int64_t due_us = 1'013'000 - frame_us(2);
  EXPECT_FALSE(poller.send_due(due_us - 1));
  ASSERT_TRUE(poller.send_due(due_us));
  EXPECT_THAT(asked(), ElementsAre(1, 2));
}

// Four answers of all, each in its window, and the poll that asks for them.
TEST_F(Polling, ARoutinePollIsOverWhenThereIsNews) {
  poller.send_due(1'000'000);
  asked();
  poller.expect_news(kFirst, 1'051'000);
  const std::int64_t answer_us = writer.line_us(106 + BUSHD_FRAME_OVERHEAD + 1) + 530;
  const std::int64_t poll_us =
      writer.line_us(2 + 4 * 5 + BUSHD_FRAME_OVERHEAD) + 1'000 + 4 * answer_us;
  const std::int64_t due_us = 1'051'000 - poll_us;
  EXPECT_EQ(poller.due_us(kSecond), due_us);
  EXPECT_FALSE(poller.send_due(due_us - 1));
  ASSERT_TRUE(poller.send_due(due_us));
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(poller.due_us(kFirst), 1'051'000 - frame_us(1));
  EXPECT_EQ(poller.due_us(kSecond), turn_after(due_us));
}

TEST_F(Polling, WhoWillHaveNewsIsNotAskedAlongBefore) {
  poller.send_due(1'000'000);
  asked();
  poller.expect_news(kSecond, 1'045'000);
  mcus[McuIndex{2}].poll_wanted = true;
  ASSERT_TRUE(poller.send_wanted(1'030'000));
  EXPECT_THAT(asked(), ElementsAre(3, 1, 4));
  EXPECT_EQ(poller.due_us(kSecond), 1'045'000 - frame_us(1));
}

TEST_F(Polling, WhoMissedItsReplyAnswersFirstAndNotAlone) {
  poller.send_due(1'000'000);
  asked();
  EXPECT_FALSE(poller.missed(1'010'000, kSecond, BUSHD_MSG_POLL));
  // A sixth of its longest answer, 82 bytes and 6 for each of four motors.
  const std::int64_t later_us = writer.line_us(106 + BUSHD_FRAME_OVERHEAD + 1) / 6;
  EXPECT_EQ(poller.due_us(kSecond), 1'030'000 + later_us) << "sooner than usual";
  mcus[kSecond].poll_wanted = true;
  ASSERT_TRUE(poller.send_wanted(1'012'000));
  EXPECT_THAT(asked(), ElementsAre(2, 1, 3, 4)) << "though their turn is 38 ms off";
  poller.answered(kSecond);
  ASSERT_TRUE(poller.send_due(1'062'000));
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4));
}

TEST_F(Polling, TenMissedRepliesInARowAreTooMany) {
  for (int i = 0; i < 9; ++i) EXPECT_FALSE(poller.missed(0, kFirst, BUSHD_MSG_CONTROL));
  poller.answered(kFirst);
  for (int i = 0; i < 9; ++i) EXPECT_FALSE(poller.missed(0, kFirst, BUSHD_MSG_CONTROL));
  EXPECT_TRUE(poller.missed(0, kFirst, BUSHD_MSG_CONTROL));
  EXPECT_EQ(mcus[kFirst].health.timeouts, 19u);
}

TEST_F(Polling, OfflineMcusAreNotAsked) {
  mcus[kFirst].view.phase = link::McuPhase::kOffline;
  mcus[kFirst].poll_wanted = true;
  poller.went_offline(kFirst);
  ASSERT_TRUE(poller.send_due(1'000'000));
  EXPECT_THAT(asked(), ElementsAre(2, 3, 4));
}

TEST_F(Polling, CountersOfReportsAddUpOverRestarts) {
  bushd_report& report = mcus[kFirst].view.report;
  report.low_water_ticks = UINT16_MAX;
  for (const std::uint16_t bad :
       std::initializer_list<std::uint16_t>{5, 7, 2}) {  // the third by another boot
    report.bad_frames = bad;
    report.ramp_downs = 1;
    poller.follow_report(0, kFirst);
  }
  EXPECT_EQ(mcus[kFirst].health.crc_errors, 9u);
  EXPECT_EQ(mcus[kFirst].health.ramp_downs, 1u);
  EXPECT_FALSE(mcus[kFirst].health.low_water_ticks);
  report.low_water_ticks = 12;
  poller.follow_report(0, kFirst);
  report.low_water_ticks = 40;
  poller.follow_report(0, kFirst);
  EXPECT_EQ(mcus[kFirst].health.low_water_ticks, 12);
}

TEST_F(Polling, WhoIsAtRestGetsRoomForLittle) {
  poller.send_due(1'000'000);
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(known, ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(room, Each(82 + 4 * 6));
  mcus[kFirst].known = 9;
  poller.follow_report(1'001'000, kFirst);
  poller.send_due(1'050'000);
  asked();
  EXPECT_THAT(known, ElementsAre(9, 0, 0, 0));
  EXPECT_THAT(room, ElementsAre(22, 106, 106, 106));
  EXPECT_EQ(begins_us[1] - begins_us[0], (22 + 10) * 20 + 530 + 10) << "its window is short";
  mcus[kFirst].sync_sent = true;
  poller.send_due(1'100'000);
  asked();
  EXPECT_THAT(room, ElementsAre(22 + 16, 106, 106, 106));
}

class EightPolling : public Polling {
 protected:
  EightPolling() : Polling(8) {}
};

// Answers take 5 ms at most, unless something moves: 640 us each, and 530 us between them. An
// adapter that holds back for long is waited for once.
TEST_F(EightPolling, RoutinePollsAtRestAreShort) {
  const auto known_and_due = [&](std::int64_t now_us) {
    for (const McuIndex i : mcus.indices()) {
      mcus[i].known = 9;
      poller.follow_report(now_us - 1'000, i);
    }
    return poller.send_due(now_us);
  };
  ASSERT_TRUE(known_and_due(1'000'000));
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4));
  EXPECT_FALSE(poller.send_wanted(1'007'000)) << "others go first";
  ASSERT_TRUE(poller.send_due(1'007'000));
  EXPECT_THAT(asked(), ElementsAre(5, 6, 7, 8));
  EXPECT_FALSE(poller.send_due(1'014'000));
  poller.expect_motion(kSecond, 1, INT64_MAX);
  ASSERT_TRUE(known_and_due(1'060'000));
  EXPECT_THAT(asked(), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

TEST_F(Polling, WhoMayHaveMuchToTellGetsRoomForIt) {
  const auto room_of_first = [&](std::int64_t now_us) {
    mcus[kFirst].known = 9;
    poller.follow_report(now_us - 1'000, kFirst);
    poller.send_due(now_us);
    asked();
    return room.front();
  };
  std::int64_t now_us = 1'000'000;
  const auto later = [&] { return now_us += 50'000; };
  constexpr int kAtRest = 22;
  constexpr int kInMotion = 22 + 16 + 7 + 12 + 15 + 4 * 6;
  constexpr int kOfPlans = 22 + 12 + 6;
  EXPECT_EQ(room_of_first(later()), kAtRest);
  mcus[kFirst].view.report.moving = 8;
  EXPECT_EQ(room_of_first(later()), kOfPlans);
  poller.expect_motion(kFirst, 5, INT64_MAX);
  EXPECT_EQ(room_of_first(later()), kOfPlans + 2 * 6);
  mcus[kFirst].sync_sent = true;
  EXPECT_EQ(room_of_first(later()), kOfPlans + 2 * 6 + 16);
  mcus[kFirst].sync_sent = false;
  mcus[kFirst].view.report.moving = 0;
  poller.expect_motion(kFirst, 1, INT64_MAX);
  mcus[kFirst].view.report.armed = 1;
  EXPECT_EQ(room_of_first(later()), kInMotion);
  mcus[kFirst].view.report.armed = 0;
  mcus[kFirst].answered = true;
  EXPECT_EQ(room_of_first(later()), kInMotion);
  mcus[kFirst].answered = false;
  EXPECT_EQ(room_of_first(later()), kOfPlans);
  poller.expect_motion(kFirst, 1, now_us + 50'000);
  EXPECT_EQ(room_of_first(later()), kAtRest + 6) << "it rests by then";
  poller.expect_motion(kFirst, 1, now_us + 60'000);
  EXPECT_EQ(room_of_first(later()), kOfPlans);
  poller.expect_motion(kFirst, 0, INT64_MAX);
  EXPECT_EQ(room_of_first(later()), kAtRest);
  mcus[kFirst].view.report.sections = BUSHD_TELLS_COUNTERS;
  EXPECT_EQ(room_of_first(later()), kAtRest + 7) << "more of them are likely";
  mcus[kFirst].view.report.sections = 0;
  for (int report = 1; report < 200; ++report) EXPECT_EQ(room_of_first(later()), kAtRest + 7);
  EXPECT_EQ(room_of_first(later()), kAtRest);
  mcus[kFirst].view.phase = link::McuPhase::kConnecting;
  EXPECT_EQ(room_of_first(later()), 106);
  mcus[kFirst].view.phase = link::McuPhase::kOnline;
  poller.missed(now_us, kFirst, BUSHD_MSG_POLL);
  EXPECT_EQ(room_of_first(later()), 106);
  poller.answered(kFirst);
  EXPECT_EQ(room_of_first(later()), kAtRest);
}

// The largest distance between the phases that these times have in a period.
std::int64_t largest_gap_us(std::vector<std::int64_t> times_us, std::int64_t period_us) {
  for (std::int64_t& time_us : times_us) time_us %= period_us;
  std::ranges::sort(times_us);
  std::int64_t gap_us = times_us.front() + period_us - times_us.back();
  for (std::size_t i = 1; i < times_us.size(); ++i) {
    gap_us = std::max(gap_us, times_us[i] - times_us[i - 1]);
  }
  return gap_us;
}

// Whatever else passes from one request to the next, and however that begins: between two bursts of
// noise one of ten answers comes, before the MCU is taken for lost.
TEST_F(Polling, NoiseWithAPeriodDoesNotMeetAllAnswers) {
  const std::int64_t answer_us = writer.line_us(BUSHD_REPORT_SIZE(4) + BUSHD_FRAME_OVERHEAD + 1);
  std::vector<std::int64_t> waits_us;
  while (!poller.missed(1'000'000, kFirst, BUSHD_MSG_POLL)) {
    waits_us.push_back(poller.due_us(kFirst) - 1'000'000);
  }
  ASSERT_EQ(waits_us.size(), 9u);
  const std::vector<std::int64_t> even(9, 0);
  const std::vector<std::int64_t> patience_grows = {-30'000, -20'000, 0, 0, 0, 0, 0, 0, 0};
  for (std::int64_t period_us = answer_us * 9 / 5; period_us < 10 * answer_us; period_us += 97) {
    for (std::int64_t besides_us = 40'000; besides_us < 40'000 + period_us; besides_us += 53) {
      for (const std::vector<std::int64_t>& more_us : {even, patience_grows}) {
        std::vector<std::int64_t> asked_us = {1'000'000};
        for (std::size_t i = 0; i < waits_us.size(); ++i) {
          asked_us.push_back(asked_us.back() + besides_us + more_us[i] + waits_us[i]);
        }
        ASSERT_LE(largest_gap_us(asked_us, period_us), period_us - answer_us)
            << "a burst every " << period_us << " us, a request every " << besides_us << " us";
      }
    }
  }
}

TEST_F(Polling, WhatHadNoRoomIsAskedForAtOnce) {
  mcus[kFirst].known = 9;
  poller.follow_report(1'000'000, kFirst);
  poller.send_due(1'000'000);
  asked();
  EXPECT_EQ(room.front(), 22);
  EXPECT_TRUE(poller.no_room(kFirst));
  ASSERT_TRUE(poller.send_wanted(1'004'000));
  EXPECT_THAT(asked(), ElementsAre(1));
  EXPECT_THAT(known, ElementsAre(9));
  EXPECT_THAT(room, ElementsAre(106));
  EXPECT_FALSE(poller.no_room(kFirst)) << "it had room for all: no such MCU keeps the line busy";
  EXPECT_FALSE(mcus[kFirst].poll_wanted);
}

TEST_F(Polling, WhatIsKnownIsForgottenAfterASecondAndWithTheMcu) {
  mcus[kFirst].known = mcus[kSecond].known = 9;
  poller.follow_report(1'000'000, kFirst);
  poller.follow_report(1'000'001, kSecond);
  poller.send_due(2'000'000);
  asked();
  EXPECT_THAT(known, ElementsAre(0, 9, 0, 0));
  poller.went_offline(kSecond);
  EXPECT_EQ(mcus[kSecond].known, 0);
}

class ManyPolling : public Polling {
 protected:
  ManyPolling() : Polling(60) {
    for (McuRecord& mcu : mcus) mcu.view.identity.motors = BUSHD_MOTORS_PER_MCU;
  }
};

// Nothing else is sent meanwhile, so queues may run low.
TEST_F(ManyPolling, CycleIsBoundedAndTheOthersComeNext) {
  ASSERT_TRUE(poller.send_due(1'000'000));
  const std::vector<int> first = asked();
  EXPECT_LT(begins_us.back(), 60'000);
  EXPECT_LT(first.size(), 60u);
  ASSERT_TRUE(poller.send_due(1'000'000));
  EXPECT_EQ(asked().front(), first.back() + 1);
}

}  // namespace
}  // namespace bushd::test
