// One request at a time; only its own answers count, and whoever owes one is named.
#include "bus/rs485/transactions.h"

#include <string>

#include "bus/rs485/machines.h"

namespace bushd::test {
namespace {

using link::Transactions;

class Transacting : public testing::Test, protected Transactions::Listener {
 protected:
  bool answered(std::int64_t, const Transactions::Answer& answer) override {
    story += "a" + std::to_string(answer.mcu.value) + " ";
    last = answer;
    return sensible;
  }
  bool unanswered(std::int64_t, McuIndex mcu, std::uint8_t) override {
    story += "u" + std::to_string(mcu.value) + " ";
    return expected;
  }
  void ended(std::int64_t, McuIndex, std::uint8_t) override { story += "e "; }
  void overheard(std::int64_t, const bushd_frame& frame) override {
    story += "o" + std::to_string(frame.type) + " ";
  }

  void ask(unsigned reply_windows = 1, std::int64_t reply_windows_us = 0) {
    transactions.ask(now_us, {.mcu = kSecond,
                              .address = McuAddress{9},
                              .type = BUSHD_MSG_CONTROL,
                              .payload = {},
                              .reply_payload = 1,
                              .reply_windows = reply_windows,
                              .reply_windows_us = reply_windows_us});
    sequence = take_sent(writer).back().sequence;
  }
  void poll() {
    const std::vector<Transactions::ReplyWindow> windows = {
        {kSecond, McuAddress{9}, 3'000, 2}, {kFirst, McuAddress{4}, 6'000, longest}};
    transactions.ask_all(now_us, BUSHD_MSG_POLL, {}, windows, 600);
    sequence = take_sent(writer).back().sequence;
  }
  void hear(std::uint8_t address, std::uint8_t type, std::uint8_t with_sequence) {
    transactions.receive(now_us, frame_bytes(address, type, with_sequence, {1, 2}));
  }
  void answer(std::uint8_t address, std::uint8_t type) {
    hear(address, static_cast<std::uint8_t>(type | BUSHD_TYPE_REPLY), sequence);
  }

  std::int64_t now_us = 1'000'000;
  link::FrameWriter writer{kBaud};
  Transactions transactions{writer, *this};
  std::uint8_t sequence = 0;
  bool sensible = true;
  bool expected = true;
  std::string story;
  Transactions::Answer last{};
  std::size_t longest = 2;  // payload of the second answer that is polled
};

TEST_F(Transacting, AnswerEndsTheTransaction) {
  ask();
  EXPECT_TRUE(transactions.open());
  answer(9, BUSHD_MSG_CONTROL);
  EXPECT_EQ(story, "a1 e ");
  EXPECT_FALSE(transactions.open());
  EXPECT_EQ(last.type, BUSHD_MSG_CONTROL);
  EXPECT_EQ(last.payload.size(), 2u);
  EXPECT_TRUE(last.in_time);
}

TEST_F(Transacting, WhatIsNotAwaitedIsStray) {
  answer(9, BUSHD_MSG_CONTROL);  // nothing was asked
  ask();
  answer(8, BUSHD_MSG_CONTROL);  // somebody else
  answer(9, BUSHD_MSG_HOME);     // to something else
  hear(9, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 1));
  EXPECT_EQ(story, "");
  EXPECT_EQ(transactions.health().stray_frames, 4u);
  EXPECT_TRUE(transactions.open());
}

TEST_F(Transacting, SecondAnswerOfOneMcuIsStray) {
  poll();
  answer(9, BUSHD_MSG_POLL);
  answer(9, BUSHD_MSG_POLL);
  EXPECT_EQ(story, "a1 ");
  EXPECT_EQ(transactions.health().stray_frames, 1u);
}

TEST_F(Transacting, RequestsOfOthersAreOverheard) {
  hear(0, BUSHD_MSG_SYNC, 3);
  EXPECT_EQ(story, "o" + std::to_string(BUSHD_MSG_SYNC) + " ");
}

TEST_F(Transacting, LastAnswerOfAPollNamesThoseWhoOweOne) {
  poll();
  answer(4, BUSHD_MSG_POLL);
  EXPECT_EQ(story, "a0 u1 e ");
  EXPECT_FALSE(transactions.open());
}

// It begins where a longer one would, so it ends sooner.
TEST_F(Transacting, AnswerThatIsShorterThanItsWindowIsExpectedSooner) {
  longest = 2 + 50;  // bytes of 20 us
  poll();
  const std::int64_t sent_us = writer.free_us();
  now_us = sent_us + 6'000 - 50 * 20 + 300;
  answer(4, BUSHD_MSG_POLL);
  EXPECT_EQ(last.line_us, 5'000);
  EXPECT_EQ(transactions.health().latency.recent_us, 300);
}

// Who asks may wait for the last one: what it reads then of the others tells nothing of the line.
TEST_F(Transacting, LatencyIsThatOfAnswersReadAsTheyCome) {
  longest = 100;
  poll();
  EXPECT_EQ(
      transactions.last_answer_us(),
      writer.free_us() + 6'000 - 20 * (100 - static_cast<std::int64_t>(bushd_report_size(0, 0))));
  now_us = transactions.last_answer_us();
  answer(9, BUSHD_MSG_POLL);
  EXPECT_EQ(transactions.health().latency.recent_us, 0) << "it may have waited";
  poll();
  now_us = transactions.last_answer_us() - 1;
  answer(9, BUSHD_MSG_POLL);
  EXPECT_GT(transactions.health().latency.recent_us, 0);
  ask();
  EXPECT_EQ(transactions.last_answer_us(), INT64_MIN) << "one answers";
}

TEST_F(Transacting, NobodyAnswersUntilTheTimeout) {
  poll();
  transactions.expire(transactions.timeout_us() - 1);
  EXPECT_EQ(story, "");
  transactions.expire(transactions.timeout_us());
  EXPECT_EQ(story, "u1 u0 e ");
}

// Several MCUs may have one address: their answers are waited for until the end.
TEST_F(Transacting, SeveralMayAnswerInWindows) {
  ask(8, 20'000);
  const std::int64_t quiet_us = transactions.quiet_us();
  EXPECT_GE(quiet_us, now_us + 20'000);
  answer(9, BUSHD_MSG_CONTROL);
  answer(9, BUSHD_MSG_CONTROL);
  EXPECT_EQ(story, "a1 a1 ");
  transactions.expire(transactions.timeout_us());
  EXPECT_EQ(story, "a1 a1 e ");
  const auto& counts = transactions.health().latency.count;
  EXPECT_TRUE(std::all_of(counts.begin(), counts.end(), [](std::uint64_t n) { return n == 0; }))
      << "in which window they came is not known";
}

TEST_F(Transacting, SenselessPayloadIsAnErrorOfTheLine) {
  sensible = false;
  ask();
  answer(9, BUSHD_MSG_CONTROL);
  EXPECT_EQ(transactions.health().crc_errors, 1u);
  EXPECT_FALSE(transactions.open()) << "it has answered all the same";
}

TEST_F(Transacting, PatienceFollowsLatencies) {
  const auto patience_us = [this] { return transactions.timeout_us() - transactions.quiet_us(); };
  ask();
  EXPECT_EQ(patience_us(), 40'000) << "any adapter keeps that";
  for (int i = 0; i < 40; ++i) {
    now_us = transactions.quiet_us();
    answer(9, BUSHD_MSG_CONTROL);
    ask();
  }
  EXPECT_EQ(patience_us(), 10'000);
  transactions.expire(transactions.timeout_us());
  ask();
  EXPECT_EQ(patience_us(), 20'000) << "after a missed reply";
  expected = false;
  transactions.expire(transactions.timeout_us());
  ask();
  EXPECT_EQ(patience_us(), 20'000) << "not for an MCU that is only looked for";
  now_us = transactions.quiet_us() + 8'000;
  answer(9, BUSHD_MSG_CONTROL);
  ask();
  EXPECT_EQ(patience_us(), 32'000) << "four latencies";
}

// Another adapter is perhaps slower. What answers too late is heard in time from then on.
TEST_F(Transacting, PatienceGrowsWithAnAdapterThatIsSlower) {
  const auto patience_us = [this] { return transactions.timeout_us() - transactions.quiet_us(); };
  const auto learn = [this] {
    for (int i = 0; i < 20; ++i) {
      ask();
      answer(9, BUSHD_MSG_CONTROL);
    }
    ask();
  };
  learn();
  ASSERT_EQ(patience_us(), 10'000);
  transactions.reset();
  ask();
  EXPECT_EQ(patience_us(), 40'000) << "of another port nothing is known yet";
  answer(9, BUSHD_MSG_CONTROL);
  learn();
  ASSERT_EQ(patience_us(), 10'000);
  expected = false;
  now_us = transactions.timeout_us();
  transactions.expire(now_us);
  answer(9, BUSHD_MSG_CONTROL);
  EXPECT_EQ(transactions.health().stray_frames, 1u);
  ask();
  EXPECT_EQ(patience_us(), 20'000) << "after an answer that came too late";
  hear(9, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 1));
  hear(9, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 2));
  answer(9, BUSHD_MSG_CONTROL);
  ask();
  EXPECT_EQ(patience_us(), 17'500) << "once for each; and it falls by an eighth";
}

// It is 25 ms late, and others have been sent and given up meanwhile.
TEST_F(Transacting, PatienceGrowsWithAnAnswerToAnEarlierRequest) {
  const auto patience_us = [this] { return transactions.timeout_us() - transactions.quiet_us(); };
  for (int i = 0; i < 20; ++i) {
    ask();
    answer(9, BUSHD_MSG_CONTROL);
  }
  expected = false;
  for (int i = 0; i < 4; ++i) {
    ask();
    now_us = transactions.timeout_us();
    transactions.expire(now_us);
  }
  poll();
  now_us = transactions.timeout_us();
  transactions.expire(now_us);
  ask();
  ASSERT_EQ(patience_us(), 10'000);
  hear(9, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 5));
  answer(9, BUSHD_MSG_CONTROL);
  ask();
  EXPECT_EQ(patience_us(), 10'000) << "that was too long ago";
  hear(9, BUSHD_MSG_CONTROL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 5));
  hear(9, BUSHD_MSG_POLL | BUSHD_TYPE_REPLY, static_cast<std::uint8_t>(sequence - 2));
  answer(9, BUSHD_MSG_CONTROL);
  ask();
  EXPECT_EQ(patience_us(), 35'000) << "both were too late";
}

TEST_F(Transacting, AnswerThatLayUnreadIsNotInTime) {
  ask();
  now_us = transactions.timeout_us() + 1;
  answer(9, BUSHD_MSG_CONTROL);
  EXPECT_EQ(story, "a1 e ");
  EXPECT_FALSE(last.in_time);
}

TEST_F(Transacting, LineTimeOfAReportIsThatOfItsWindow) {
  poll();
  answer(4, BUSHD_MSG_POLL);
  EXPECT_EQ(last.line_us, 6'000);
}

TEST_F(Transacting, AbandonedTransactionEndsWithoutAWord) {
  poll();
  transactions.abandon();
  transactions.expire(now_us + 10'000'000);
  answer(4, BUSHD_MSG_POLL);
  EXPECT_EQ(story, "");
}

TEST_F(Transacting, BrokenBytesAreCounted) {
  Bytes wire = frame_bytes(9, BUSHD_MSG_CONTROL, 1, {1, 2, 3});
  wire[5] ^= 0x10;
  transactions.receive(now_us, wire);
  EXPECT_EQ(transactions.health().crc_errors, 1u);
  EXPECT_EQ(story, "");
}

TEST(FrameWriter, DelimiterComesFirstAfterSilenceOnly) {
  link::FrameWriter writer(kBaud);
  writer.reset(0);
  writer.send(1'000, McuAddress{1}, BUSHD_MSG_CONTROL, {});
  const std::size_t first = writer.bytes().size();
  EXPECT_EQ(writer.bytes().front(), 0);
  writer.send(1'000, McuAddress{1}, BUSHD_MSG_CONTROL, {});
  EXPECT_EQ(writer.bytes().size(), 2 * first - 1);
  const auto sent = take_sent(writer);
  ASSERT_EQ(sent.size(), 2u);
  EXPECT_EQ(sent[1].sequence, sent[0].sequence + 1);
}

TEST(FrameWriter, RoomEndsWithFiveMillisecondsOfBacklog) {
  link::FrameWriter writer(kBaud);
  writer.reset(0);
  const Bytes payload(200);
  while (writer.has_room(0)) writer.send(0, McuAddress{1}, BUSHD_MSG_TICKS, payload);
  EXPECT_EQ(take_sent(writer).size(), 2u) << "4.2 ms each";
  EXPECT_FALSE(writer.has_room(writer.room_from_us() - 1));
  EXPECT_TRUE(writer.has_room(writer.room_from_us()));
}

}  // namespace
}  // namespace bushd::test
