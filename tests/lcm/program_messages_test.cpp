// Messages about programs of MCUs arrive as they were meant.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lcm/arrival.h"

namespace bushd::lcm {
namespace {

using test::kId;

TEST(ProgramMessages, RequestsArriveAsTheyWereMeant) {
  test::expect_arrives(api::PutProgram{.program = "scan",
                                       .text = "t\n",
                                       .points = {{"p.csv", "x\n1\n"}, {"q.csv", ""}},
                                       .dry_run = true});
  test::expect_arrives(api::EraseProgram{"scan"});
  test::expect_arrives(api::RunPrograms{{"p", "q"}});
}

// All that a program may be, in one message.
TEST(ProgramMessages, TheGreatestProgramArrives) {
  const std::string half(api::PutProgram::kMostBytes / 2, '#');
  test::expect_arrives(
      api::PutProgram{.program = "scan", .text = half, .points = {{"p.csv", half}}});
}

// On LCM a client hears the channels of this list, and no other.
TEST(ProgramMessages, ClientsListenToTheChannelOfTheAnswer) {
  const api::Completed reply{.reason = "r", .detail = api::ProgramList{}};
  const std::string channel = encode(1, kId, reply).value().front().channel;
  EXPECT_EQ(channel, "PROGRAM_REPLY");
  EXPECT_EQ(std::ranges::count(daemon_channels(), channel), 1);
}

TEST(ProgramMessages, ProgramsOfManyMcusComeInParts) {
  api::ProgramList list;
  for (int mcu = 0; mcu < 128; ++mcu) {
    api::ProgramEntry entry{.mcu = "hall:" + std::to_string(mcu),
                            .program = "scan",
                            .checksum = "0a1b2c3d",
                            .stage = "paused",
                            .reason = "r",
                            .without_host = mcu % 2 == 0,
                            .bytes = mcu,
                            .memory = 8192,
                            .frame = 3,
                            .point = 4,
                            .repeats = 5,
                            .duration_us = 6,
                            .pulses = 7,
                            .endless = mcu % 3 == 0,
                            .waits_for_inputs = mcu % 5 == 0,
                            .cut = mcu % 7 == 0};
    for (int motor = 0; motor < 16; ++motor) {
      entry.motors.push_back({.motor = std::string(60, 'm'),
                              .least_steps = -motor,
                              .most_steps = std::int64_t{1} << 40,
                              .end_steps = motor,
                              .edges = 8});
    }
    list.programs.push_back(std::move(entry));
  }
  const api::Completed reply{.reason = "r", .detail = list};
  const auto packets = encode(1, kId, reply).value();
  EXPECT_GT(packets.size(), 1u);
  ReplyParts parts;
  std::optional<api::Reply> whole;
  for (auto packet = packets.rbegin(); packet != packets.rend(); ++packet) {
    EXPECT_FALSE(whole);
    const auto part = decode_daemon_message(packet->channel, packet->payload);
    whole = parts.add(std::get<ReplyMessage>(*part));
  }
  ASSERT_TRUE(whole);
  EXPECT_EQ(std::get<api::ProgramList>(std::get<api::Completed>(*whole).detail), list);
}

}  // namespace
}  // namespace bushd::lcm
