#include "daemon/services/positions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "daemon/lab.h"
#include "daemon/live_bench.h"
#include "daemon/lost_frames.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::LiveBench;
using testing::HasSubstr;

std::string with_unit(const std::string& toml) {
  return test::with_keys(toml, "m01", "unit = \"mm\"\nsteps_per_unit = 400\n");
}

struct PositionsBench : LiveBench {
  PositionsBench() { connect(stops); }  // what connect() serves besides is all that is needed
  void set(std::int64_t number, std::vector<api::MotorAmount> motors) {
    positions.request(now_us(), asker(number), api::SetPosition{std::move(motors)});
  }
  Stops stops{installation, moves, homing, travels, programs, local_inputs, open_moves};
};

TEST(Positions, AreSetInTheMcusAndLogged) {
  PositionsBench bench;
  bench.set(1, {{"m01", -77}, {"m04", 123456}});
  EXPECT_TRUE(bench.positions.being_set(bench.motor("m01")));
  EXPECT_FALSE(bench.positions.being_set(bench.motor("m02")));
  EXPECT_THAT(bench.interlocks.may_move(bench.motor("m04")).error().text(),
              HasSubstr("its position is being set"));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
  EXPECT_FALSE(bench.positions.being_set(bench.motor("m01")));
  EXPECT_EQ(bench.of("m01").position_steps(), -77);
  EXPECT_EQ(bench.of("m04").position_steps(), 123456);
  EXPECT_EQ(bench.shaft_steps("m01"), 0) << "nothing has moved";
  ASSERT_EQ(bench.lines.size(), 2u);
  EXPECT_THAT(bench.lines[0], HasSubstr("\"event\":\"set\""));
}

TEST(Positions, SettingMakesThemKnown) {
  PositionsBench bench;
  bench.line.reboot(0, 10'000'000);
  ASSERT_TRUE(bench.run_until([&] { return !bench.all_online(); }));
  ASSERT_TRUE(bench.run_until([&] { return bench.all_online(); }));
  ASSERT_TRUE(bench.of("m01").trust().uncertain_reason()) << "its MCU has booted anew";
  bench.set(1, {{"m01", 5}});
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kDone);
  EXPECT_FALSE(bench.of("m01").trust().uncertain_reason());
  EXPECT_TRUE(bench.of("m02").trust().uncertain_reason()) << "that one was not set";
}

TEST(Positions, AreSetAtRestOnlyAndWithinTheirRange) {
  PositionsBench bench;
  bench.move(1, "m01", 200);
  bench.set(2, {{"m02", 1}, {"m01", 1}});
  EXPECT_THAT(bench.refusal(2), HasSubstr("m01 moves; its position can be set at rest only"));
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kReached);
  bench.set(3, {{"m01", motion::Motor::kMaxPosition + 1}});
  EXPECT_THAT(bench.refusal(3), HasSubstr("positions lie within +-2147483647"));
  bench.set(4, {{"m01", 1}});
  bench.set(5, {{"m01", 2}});
  EXPECT_THAT(bench.refusal(5), HasSubstr("its position is being set"));
  bench.result(4);
  EXPECT_EQ(bench.of("m01").position_steps(), 1);
}

// Some of those that are to be set may be set, and offsets are none of the MCU's.
TEST(Positions, SetByHalvesAreSaidAndOffsetsStayThen) {
  test::ReadyLab lab(with_unit(test::hall(2, 2)));
  lab.on_send = test::loses(2, BUSHD_MSG_SET_POSITION);
  const auto number = lab.send(api::SetPosition{
      {{"m01", api::UserUnits{5}}, {"m02", std::int64_t{77}}, {"m03", std::int64_t{-3}}}});
  lab.run_for(1);
  EXPECT_EQ(lab.motor("m01").user, 0) << "not before the MCUs have the others";
  const test::Answer meanwhile = lab.ask(test::Ask::kMoveBy, {"m01"}, {10});
  EXPECT_THAT(meanwhile.reason, HasSubstr("its position is being set"));
  const test::Answer answer = lab.wait(number);
  EXPECT_THAT(answer, test::Ends("fault", "MCU hall:2 did not confirm it in time"));
  EXPECT_THAT(answer.reason, HasSubstr("; set: m02; not set: m03, m01"));
  EXPECT_EQ(lab.motor("m01").user, 0);
  EXPECT_EQ(lab.motor("m02").position_steps, 77);
  EXPECT_EQ(std::ranges::count_if(lab.move_lines(),
                                  [](const std::string& line) {
                                    return line.find("\"set\"") != std::string::npos &&
                                           line.find("\"position_steps\":77") != std::string::npos;
                                  }),
            1);
  lab.on_send = {};
  EXPECT_EQ(lab.ask(api::SetPosition{{{"m01", api::UserUnits{5}},
                                      {"m02", std::int64_t{77}},
                                      {"m03", std::int64_t{-3}}}})
                .result,
            "done");
  EXPECT_EQ(lab.motor("m01").user, 5);
}

}  // namespace
}  // namespace bushd::daemon
