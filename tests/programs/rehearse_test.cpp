// The dry run of a program: how long it takes, and where its motors come to.
#include "engine/reference.h"
#include "programs/program_places.h"

namespace bushd::test {
namespace {

class Rehearsals : public ProgramPlaces {
 protected:
  // By the sums of the slow reference.
  std::uint64_t ticks_of(std::size_t steps, std::uint64_t shortest_delay = 0) const {
    const auto run = Reference::move(program_law(), steps, shortest_delay);
    const Wide tick = Wide{mcu_.tick_ns} * 256;
    return static_cast<std::uint64_t>((run.step(steps - 1).end + tick - 1) / tick);
  }
};

TEST_F(Rehearsals, TellDurationWaysAndEdges) {
  motors_[0].at_steps = 30;
  const auto told = good(rehearse(R"(
[[frame]]
move_to = [100, 1]
[[frame]]
repeat = 3
[[frame]]
line_to = [[-50, 0.25], [0, 1]]
[[frame]]
pulse_us = 10
[[frame]]
wait_s = 0.01
[[frame]]
next = true
[[frame]]
move_by = { x = -9 }
speed = 100
)"));
  // theta 400 steps, x 70; then to (-50, 100) from (100, 400), later from (0, 400).
  const std::uint64_t waits = 3 * 4;
  EXPECT_EQ(told.ticks, ticks_of(400) + 6 * ticks_of(300) + waits + ticks_of(9, 250));
  EXPECT_EQ(told.pulses, 3u);
  EXPECT_FALSE(told.endless);
  EXPECT_FALSE(told.cut);
  EXPECT_FALSE(told.waits_for_inputs);
  EXPECT_EQ(told.motors[0].least_steps, -50);
  EXPECT_EQ(told.motors[0].most_steps, 100);
  EXPECT_EQ(told.motors[0].end_steps, -9);
  EXPECT_EQ(told.motors[0].edges, 70u + 150 + 50 + 50 + 50 + 50 + 50 + 9);
  EXPECT_EQ(told.motors[1].end_steps, 400);
  EXPECT_EQ(told.motors[1].edges, 400u + 6 * 300);
}

TEST_F(Rehearsals, OfOneWithoutEndTellAPass) {
  const auto told = rehearse(R"(
[[frame]]
repeat = 0
[[frame]]
wait_input = "forward"
[[frame]]
move_by = { x = 10 }
[[frame]]
next = true
)");
  ASSERT_TRUE(told);
  EXPECT_TRUE(told->endless);
  EXPECT_TRUE(told->waits_for_inputs);
  EXPECT_EQ(told->ticks, ticks_of(10));
  EXPECT_EQ(told->motors[0].end_steps, 10);
}

// It may be anywhere on its way then: both ends are walked on from, until a position is named.
TEST_F(Rehearsals, AMoveThatAnInputEndsLeadsToAnyPlaceOfItsWay) {
  const std::string until = "\nuntil_input = 1\n[[frame]]\n";
  const auto told = good(rehearse("[[frame]]\nmove_by = { x = 2000 }" + until +
                                  "move_by = { x = -3000 }" + until + "move_by = { x = 500 }\n"));
  EXPECT_TRUE(told.waits_for_inputs);
  EXPECT_EQ(told.motors[0].least_steps, -3000);
  EXPECT_EQ(told.motors[0].most_steps, 2500);
  EXPECT_EQ(told.motors[0].edges, 5500u);
  EXPECT_EQ(told.ticks, ticks_of(2000) + ticks_of(3000) + ticks_of(500));
  EXPECT_THAT(
      error_of(rehearse("[[frame]]\nmove_by = { x = 4000 }" + until + "move_by = { x = -5001 }\n")),
      HasSubstr("would go to -5001 steps"));
  EXPECT_TRUE(rehearse("[[frame]]\nmove_by = { x = 4000 }" + until +
                       "move_to = { x = 3000 }\n[[frame]]\nmove_by = { x = 3000 }\n"));
}

TEST_F(Rehearsals, AnElementaryLineHasTheStepsOfAll) {
  const auto told = good(rehearse("[[frame]]\nline_by = [[500, 1]]\nlaw = \"elementary\"\n"));
  EXPECT_EQ(told.ticks, ticks_of(900));
  EXPECT_EQ(told.motors[0].edges, 500u);
  EXPECT_EQ(told.motors[1].edges, 400u);
}

TEST_F(Rehearsals, FindThePassThatLeadsBeyondALimit) {
  const std::string frames = R"(
[[frame]]
repeat = 20
[[frame]]
line_by = [[500, 0], [-100, 0]]
[[frame]]
next = true
)";
  const auto told = rehearse(frames);
  EXPECT_THAT(error_of(told), HasSubstr("p.toml:5, point 1: motor \"x\" would go to 6100 steps"));
  motors_[0].most_steps = 8100;
  EXPECT_TRUE(rehearse(frames));
  motors_[0].most_steps = 8099;
  EXPECT_FALSE(rehearse(frames));
}

TEST_F(Rehearsals, FramesThatTakeNoTimeAreSpreadOverTicks) {
  const auto told =
      rehearse("[[frame]]\nrepeat = 100\n[[frame]]\nmove_by = { x = 0 }\n[[frame]]\nnext = true\n");
  ASSERT_TRUE(told);
  // 1 + 200 + END, eight in a tick.
  EXPECT_EQ(told->ticks, 202u / 8 - (202 % 8 == 0 ? 1 : 0));
}

TEST_F(Rehearsals, AreCutWhereTheyWouldNotEnd) {
  std::string frames;
  for (int i = 0; i < 4; ++i) frames += "[[frame]]\nrepeat = 65535\n";
  for (int i = 0; i < 4; ++i) frames += "[[frame]]\nnext = true\n";
  const auto told = rehearse(frames);
  ASSERT_TRUE(told);
  EXPECT_TRUE(told->cut);
}

TEST_F(Rehearsals, OfThoseThatBeginAtPowerOnStayWithinTheirRange) {
  motors_[0].at_steps = 1000;
  const auto rehearsed = [&](int steps) -> Result<programs::Rehearsal> {
    const auto program = parse(
        "motors = [\"x\", \"theta\"]\nwithout_host = true\nkept = true\nat_power_on = true\n"
        "range = { theta = [0, 0], x = [-40, 100] }\n[[frame]]\nrepeat = 3\n[[frame]]\n"
        "move_by = { x = " +
        std::to_string(steps) + " }\n[[frame]]\nnext = true\n");
    EXPECT_TRUE(program) << program.error().text();
    const auto bytes = compile(*program);
    if (!bytes) return fail(bytes.error());
    return programs::rehearse(*program, mcu_, motors_, *bytes);
  };
  const auto told = good(rehearsed(33));
  EXPECT_EQ(told.motors[0].end_steps, 1099);
  for (const int steps : {34, -14}) {
    const auto beyond = rehearsed(steps);
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().text(),
              "p.toml:8: motor \"x\" would come " + std::to_string(3 * steps) +
                  " steps from where it begins, but its range is -40 to 100 steps");
  }
}

}  // namespace
}  // namespace bushd::test
