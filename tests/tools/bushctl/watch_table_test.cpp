// The table of `bushctl watch`: what of many motors is seen in a small terminal, and what keys
// change.
#include "tools/bushctl/watch_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tools/bushctl/screen.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Status;
using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;
using testing::ResultOf;
using testing::SizeIs;
using testing::StartsWith;

constexpr std::size_t kColumns = 80;
constexpr std::size_t kRows = 24;

// m001 .. m128, 16 at each of 8 MCUs, in mm and with soft limits.
Status hall() {
  Status status;
  status.states.resize(8);
  status.descriptions.resize(8);
  for (int i = 0; i < 128; ++i) {
    auto& state = status.states[static_cast<std::size_t>(i / 16)].snapshot;
    auto& description = status.descriptions[static_cast<std::size_t>(i / 16)].snapshot;
    state.mcu = description.mcu = "hall:" + std::to_string(i / 16 + 1);
    state.state = api::McuState::kReady;
    description.address = i / 16 + 1;
    const std::string name = "m" + std::to_string(1001 + i).substr(1);
    state.motors.push_back({.name = name,
                            .position_steps = 40 * i,
                            .user = 0.1 * i,
                            .target_steps = 40 * i,
                            .user_target = 0.1 * i,
                            .trust = api::Trust::kKnown});
    description.motors.push_back({.name = name,
                                  .output = static_cast<std::uint8_t>(i % 16),
                                  .group = i % 2 == 0 ? "stages" : "slits",
                                  .table = {.name = "bushd2-constant"},
                                  .scale = {.unit = "mm",
                                            .steps_per_unit = *bushd::units::parse_ratio("400"),
                                            .decimals = 4},
                                  .soft_limits = bushd::units::SoftLimits{-5, 25}});
  }
  return status;
}

api::MotorState& motor(Status& status, int number) {
  const auto i = static_cast<std::size_t>(number - 1);
  return status.states[i / 16].snapshot.motors[i % 16];
}

class WatchOfManyMotors : public testing::Test {
 protected:
  std::vector<std::string> lines(std::size_t columns = kColumns) {
    return table.lines(status, columns, kRows);
  }
  // The names in the rows of motors.
  std::vector<std::string> names() {
    std::vector<std::string> out;
    for (const std::string& line : lines()) {
      if (line.starts_with("m")) out.push_back(line.substr(0, 4));
    }
    return out;
  }
  Status status = hall();
  WatchTable table{{}};
};

TEST_F(WatchOfManyMotors, FitsIntoTheTerminal) {
  motor(status, 100).moving = true;
  motor(status, 100).velocity_steps_per_s = -1000;
  EXPECT_THAT(lines(), SizeIs(kRows));
  EXPECT_THAT(lines(), Each(ResultOf([](const std::string& line) { return line.size(); },
                                     testing::Le(kColumns))));
  // Speed, limits and trust are what one looks for; the MCU is seen where there is room.
  EXPECT_THAT(lines()[1], AllOf(HasSubstr("POSITION"), HasSubstr("SPEED"), HasSubstr("LIMITS"),
                                HasSubstr("TRUST"), Not(HasSubstr("MCU"))));
  EXPECT_THAT(lines()[2], AllOf(StartsWith("m100   9.9000 mm"), HasSubstr("-2.5000 mm/s"),
                                HasSubstr("yes"), HasSubstr("known"), HasSubstr("-5 |")));
  EXPECT_THAT(lines(140)[1], AllOf(HasSubstr("MCU"), HasSubstr("GROUP"), HasSubstr("TABLE")));
}

TEST_F(WatchOfManyMotors, ShowsFirstWhatMovesThenWhatIsWrong) {
  motor(status, 90).moving = true;
  motor(status, 17).trust = api::Trust::kUncertain;
  motor(status, 40).inhibited.positive = true;
  EXPECT_THAT(names(), testing::Contains("m001"));
  auto shown = names();
  shown.resize(4);
  EXPECT_THAT(shown, testing::ElementsAre("m090", "m040", "m017", "m001"));
  table.take_keys("o");
  EXPECT_EQ(names().front(), "m001");
  table.take_keys("o");
  EXPECT_EQ(names().front(), "m090");
}

TEST_F(WatchOfManyMotors, ShowsWhatDoesNotWorkBeforePositionsThatNobodyKnows) {
  for (int i = 1; i <= 128; ++i) motor(status, i).trust = api::Trust::kUncertain;
  motor(status, 60).inhibited.negative = true;
  status.states[7].snapshot.state = api::McuState::kFault;
  EXPECT_THAT(names().front(), "m060");
  EXPECT_THAT(names().at(1), "m113");
  EXPECT_THAT(names().at(17), "m001");
}

TEST_F(WatchOfManyMotors, ShowsALimitWhereThereIsNoRoomForNotes) {
  motor(status, 40).inhibited.positive = true;
  motor(status, 40).trust = api::Trust::kUncertain;
  EXPECT_THAT(clipped(lines()[2], kColumns), AllOf(StartsWith("m040 "), HasSubstr("  limit  ")));
  EXPECT_THAT(lines(160)[2], AllOf(HasSubstr("  -  "), HasSubstr("  limit positive")));
}

TEST(Screen, ClipsLinesAtACharacterAndSaysThatThereIsMore) {
  EXPECT_EQ(clipped("12345", 5), "12345");
  EXPECT_EQ(clipped("123456", 5), "1234>");
  EXPECT_EQ(clipped("\u00b5m \u00b0", 4), "\u00b5m \u00b0");
  EXPECT_EQ(clipped("12\u00b5\u00b0\u00b5", 4), "12\u00b5>");
  EXPECT_EQ(clipped("", 1), "");
}

TEST_F(WatchOfManyMotors, TellsOfMcusThatDoNotWorkOnEveryPage) {
  EXPECT_EQ(lines()[0], "128 motors, 0 moving; 8 MCUs, all work");
  for (const std::size_t mcu : {2u, 3u, 4u, 7u}) {
    status.states[mcu].snapshot.state = api::McuState::kOffline;
    status.states[mcu].snapshot.detail = "no answer";
  }
  status.states[7].snapshot.state = api::McuState::kFault;
  for (int page = 0; page < 3; ++page) {
    EXPECT_EQ(lines()[0], "128 motors, 0 moving; 8 MCUs, 1 FAULT, 3 OFFLINE");
    EXPECT_EQ(lines()[1], "hall:3 OFFLINE: no answer");
    EXPECT_EQ(lines()[3], "hall:5 OFFLINE: no answer; and 1 more");
    EXPECT_THAT(lines(), SizeIs(kRows));
    table.take_keys("n");
  }
}

TEST_F(WatchOfManyMotors, HasPages) {
  std::vector<std::string> seen;
  EXPECT_THAT(lines().back(), StartsWith("page 1 of 7  "));
  for (int page = 0; page < 7; ++page) {
    for (const std::string& name : names()) seen.push_back(name);
    table.take_keys(page % 2 == 0 ? "n" : "\x1b[6~");
  }
  EXPECT_THAT(seen, SizeIs(128)) << "each motor once";
  std::ranges::sort(seen);
  EXPECT_EQ(std::ranges::unique(seen).begin(), seen.end());
  EXPECT_THAT(lines().back(), StartsWith("page 7 of 7  "));
  table.take_keys("p\x1b[5~");
  EXPECT_THAT(lines().back(), StartsWith("page 5 of 7  "));
  table.take_keys("g");
  EXPECT_THAT(lines().back(), StartsWith("page 1 of 7  "));
}

TEST_F(WatchOfManyMotors, AreFilteredByNameGroupAndMcu) {
  table.take_keys("/m00");
  EXPECT_THAT(lines().back(), HasSubstr("@group): m00_"));
  EXPECT_THAT(names(), SizeIs(9));
  table.take_keys("5\r");
  EXPECT_THAT(names(), testing::ElementsAre("m005"));
  EXPECT_THAT(lines()[0], HasSubstr("; 1 shown"));
  EXPECT_THAT(lines().back(), HasSubstr("shows m005 (Esc: all)"));
  table.take_keys("/slits\r");
  EXPECT_THAT(lines().back(), AllOf(StartsWith("page 1 of 4  "), HasSubstr("q ends  shows slits")));
  EXPECT_LE(lines().back().size(), kColumns);
  table.take_keys("/@sl*\r");
  EXPECT_THAT(lines()[0], HasSubstr("; 64 shown"));
  table.take_keys("/hall:2\n");
  EXPECT_THAT(lines()[0], HasSubstr("; 16 shown"));
  table.take_keys(
      "/*7\x7f"
      "8\r");
  EXPECT_THAT(lines()[0], HasSubstr("; 13 shown"));
  table.take_keys("\x1b");
  EXPECT_THAT(lines()[0], Not(HasSubstr("shown")));
  table = WatchTable({"m00[12]", "m128"});
  EXPECT_THAT(names(), testing::ElementsAre("m001", "m002", "m128"));
}

TEST_F(WatchOfManyMotors, KeysThatAreTypedIntoAFilterAreNoCommands) {
  EXPECT_TRUE(table.take_keys("/q\r"));
  EXPECT_THAT(names(), SizeIs(0));
  EXPECT_FALSE(table.take_keys("q"));
}

}  // namespace
}  // namespace bushctl
