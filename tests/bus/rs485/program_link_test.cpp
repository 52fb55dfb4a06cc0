// What is asked of the program of one MCU, and in which order.
#include "bus/rs485/program_link.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "engine/program.h"

namespace bushd::link {
namespace {

constexpr std::int64_t kNow = 5'000'000;

bushd_program_state state_of(bushd_program_stage stage) {
  bushd_program_state state{};
  state.stage = stage;
  return state;
}

// The action of the order that is sent now; -1: it is the question, -2: nothing.
int next_action(ProgramLink& link, std::int64_t now_us = kNow) {
  if (!link.has_request(now_us)) return -2;
  const Request& request = link.ask(now_us);
  return request.type == BUSHD_MSG_PROGRAM_STATE ? -1 : request.payload[0];
}

std::vector<std::uint8_t> counting(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

TEST(ProgramLink, PutsPartsInOrderAndCommits) {
  ProgramLink link;
  const std::vector<std::uint8_t> bytes = counting(500);
  link.put(bytes);
  EXPECT_FALSE(link.has_request(kNow)) << "an upload is in nobody's way";
  std::vector<std::uint8_t> taken;
  for (const std::size_t put : {243u, 486u, 500u}) {
    ASSERT_TRUE(link.has_part());
    const Request request = link.ask_part();
    ASSERT_EQ(request.type, BUSHD_MSG_PROGRAM_PUT);
    EXPECT_EQ(bushd_get_u16(&request.payload[0]), taken.size());
    EXPECT_EQ(bushd_get_u16(&request.payload[2]), 500);
    taken.insert(taken.end(), request.payload.begin() + 4, request.payload.end());
    EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM_PUT, BUSHD_OK), ProgramLink::Answer::kOfUpload);
    EXPECT_EQ(link.view().put, put);
    EXPECT_EQ(link.view().total, 500u);
    EXPECT_TRUE(link.view().uploading);
  }
  EXPECT_EQ(taken, bytes);
  const Request commit = link.ask_part();
  ASSERT_EQ(commit.type, BUSHD_MSG_PROGRAM);
  EXPECT_EQ(commit.payload[0], BUSHD_PROGRAM_COMMIT);
  EXPECT_EQ(bushd_get_u32(&commit.payload[2]), ~bushd_crc32(BUSHD_CRC32_START, bytes.data(), 500));
  EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK), ProgramLink::Answer::kOfUpload);
  EXPECT_FALSE(link.view().uploading);
  EXPECT_EQ(link.view().refused, BUSHD_OK);
  EXPECT_FALSE(link.has_part());
  EXPECT_EQ(next_action(link), -1) << "it is asked what it has now";
}

TEST(ProgramLink, ARefusalEndsTheUploadAtAnyPart) {
  for (int refused = 0; refused < 3; ++refused) {
    ProgramLink link;
    link.put(counting(300));
    for (int i = 0; i < refused; ++i) link.acknowledged(link.ask_part().type, BUSHD_OK);
    EXPECT_EQ(link.acknowledged(link.ask_part().type, BUSHD_E_FORMAT),
              ProgramLink::Answer::kOfUpload);
    EXPECT_FALSE(link.has_part());
    EXPECT_FALSE(link.view().uploading);
    EXPECT_EQ(link.view().refused, BUSHD_E_FORMAT);
  }
}

TEST(ProgramLink, WhatNoMcuCouldHoldIsNotSent) {
  for (const std::size_t size : {std::size_t{0}, std::size_t{65'536}}) {
    ProgramLink link;
    link.put(counting(size));
    EXPECT_FALSE(link.has_part());
    EXPECT_FALSE(link.view().uploading);
    EXPECT_EQ(link.view().refused, BUSHD_E_CAPACITY);
  }
}

TEST(ProgramLink, AnAnswerToAnEarlierUploadIsNotOfTheNext) {
  ProgramLink link;
  link.put(counting(300));
  link.ask_part();
  link.put(counting(400));
  EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM_PUT, BUSHD_OK), ProgramLink::Answer::kNone);
  EXPECT_EQ(link.view().put, 0u);
  EXPECT_EQ(bushd_get_u16(&link.ask_part().payload[0]), 0);
  EXPECT_EQ(bushd_get_u16(&link.ask_part().payload[2]), 400);
}

TEST(ProgramLink, ErasingEndsAnUpload) {
  ProgramLink link;
  link.put(counting(300));
  link.acknowledged(link.ask_part().type, BUSHD_OK);
  link.erase();
  EXPECT_FALSE(link.has_part());
  EXPECT_EQ(link.view().total, 0u);
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_ERASE);
}

TEST(ProgramLink, OrdersGoInTheirOrderEachUntilItIsAnswered) {
  ProgramLink link;
  link.run(7, 0x1'0000'1234);
  link.pause();
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_RUN);
  EXPECT_EQ(link.ask(kNow).payload[1], 7);
  EXPECT_EQ(bushd_get_u32(&link.ask(kNow).payload[2]), 0x1234u);
  EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK), ProgramLink::Answer::kTaken);
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_PAUSE);
  EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_E_STATE), ProgramLink::Answer::kRefused);
  EXPECT_EQ(next_action(link), -1);
}

TEST(ProgramLink, AStopDiscardsWhatWaitsAndIsUrgent) {
  ProgramLink link;
  link.run(1, 1000);
  link.resume();
  EXPECT_FALSE(link.is_urgent(kNow));
  link.stop(BUSHD_STOP_IMMEDIATE);
  EXPECT_TRUE(link.is_urgent(kNow));
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_STOP);
  EXPECT_EQ(link.ask(kNow).payload[2], BUSHD_STOP_IMMEDIATE);
  EXPECT_FALSE(link.is_urgent(kNow)) << "one that is not answered lets others have their turns";
  EXPECT_TRUE(link.is_urgent(kNow + 100'000));
  link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK);
  EXPECT_EQ(next_action(link), -1);
}

// RUN is on the line when the stop is asked for: its answer is not that of the stop.
TEST(ProgramLink, TheAnswerToADiscardedOrderIsNotThatOfTheStop) {
  ProgramLink link;
  link.run(1, 1000);
  link.ask(kNow);
  link.stop(BUSHD_STOP_RAMP);
  EXPECT_EQ(link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK), ProgramLink::Answer::kNone);
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_STOP);
}

TEST(ProgramLink, APauseDiscardsAResumeThatWaitsAndAnEmergencyWhatBegins) {
  ProgramLink link;
  link.resume();
  link.pause();
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_PAUSE);
  link.clear();
  link.run(1, 1000);
  link.pause();
  link.resume();
  link.discard_motion();
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_PAUSE);
  link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK);
  EXPECT_EQ(next_action(link), -1);
}

TEST(ProgramLink, ARunThatIsNotTakenInTimeIsStopped) {
  ProgramLink link;
  link.run(1, 1000);
  EXPECT_FALSE(link.end_late_run(979, 20));
  EXPECT_TRUE(link.end_late_run(980, 20));
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_STOP) << "it may have come all the same";
  EXPECT_FALSE(link.end_late_run(990, 20)) << "once";
}

TEST(ProgramLink, IsAskedForAsLongAsOneIsUnderWay) {
  for (int stage = BUSHD_PROGRAM_NONE; stage <= BUSHD_PROGRAM_ENDED; ++stage) {
    ProgramLink link;
    EXPECT_EQ(link.due_us(), INT64_MAX);
    link.want_state();
    EXPECT_FALSE(link.settled());
    EXPECT_EQ(next_action(link), -1);
    link.told(kNow, state_of(static_cast<bushd_program_stage>(stage)));
    EXPECT_TRUE(link.settled());
    EXPECT_EQ(link.view().heard_us, kNow);
    const bool under_way = stage >= BUSHD_PROGRAM_WAITS && stage <= BUSHD_PROGRAM_ENDS;
    EXPECT_EQ(link.due_us(), under_way ? kNow + 200'000 : INT64_MAX);
    link.run(1, 1000);
    EXPECT_FALSE(link.settled());
  }
}

TEST(ProgramLink, WhoDoesNotTellIsNotAskedAgain) {
  ProgramLink link;
  link.want_state();
  link.acknowledged(BUSHD_MSG_PROGRAM_STATE, BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_TRUE(link.denied());
  EXPECT_FALSE(link.view().known);
  EXPECT_EQ(next_action(link), -2);
}

// One that is to outlive power cuts is asked for until it would.
TEST(ProgramLink, AsksUntilItIsStored) {
  bushd_program_state stored = state_of(BUSHD_PROGRAM_LOADED);
  stored.flags = BUSHD_PROGRAM_KEPT | BUSHD_PROGRAM_STORED;
  bushd_program_state not_yet = stored;
  not_yet.flags = BUSHD_PROGRAM_KEPT;
  ProgramLink link;
  link.told(kNow, state_of(BUSHD_PROGRAM_NONE));
  link.put({1, BUSHD_PROGRAM_KEPT, 0});
  link.told(kNow, stored);  // before any of it has come
  for (const std::uint8_t type : {BUSHD_MSG_PROGRAM_PUT, BUSHD_MSG_PROGRAM}) {
    link.ask_part();
    link.acknowledged(type, BUSHD_OK);
  }
  EXPECT_EQ(next_action(link), -1);
  link.told(kNow, not_yet);
  EXPECT_EQ(next_action(link, kNow + 199'999), -2);
  EXPECT_EQ(next_action(link, kNow + 200'000), -1);
  link.told(kNow, stored);
  EXPECT_EQ(link.due_us(), INT64_MAX);
  link.erase();
  link.told(kNow, stored);
  EXPECT_EQ(next_action(link), BUSHD_PROGRAM_ERASE);
  link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK);
  link.told(kNow, state_of(BUSHD_PROGRAM_NONE));
  EXPECT_EQ(link.due_us(), kNow + 200'000) << "a reset would bring it back";
  bushd_program_state gone = state_of(BUSHD_PROGRAM_NONE);
  gone.flags = BUSHD_PROGRAM_STORED;
  link.told(kNow, gone);
  EXPECT_EQ(link.due_us(), INT64_MAX);
  link.put({1, BUSHD_PROGRAM_WITHOUT_HOST, 0});
  link.ask_part();
  link.acknowledged(BUSHD_MSG_PROGRAM_PUT, BUSHD_OK);
  link.ask_part();
  link.acknowledged(BUSHD_MSG_PROGRAM, BUSHD_OK);
  link.told(kNow, state_of(BUSHD_PROGRAM_LOADED));
  EXPECT_EQ(link.due_us(), INT64_MAX);
}

}  // namespace
}  // namespace bushd::link
