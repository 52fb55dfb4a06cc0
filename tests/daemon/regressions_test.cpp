// What tools/bushfaults found, each reduced to the least that shows it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

class Regressions : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, Regressions, testing::Values("fine", "coarse"),
                         [](const auto& format) { return std::string(format.param); });

// A stop that takes effect at the very tick of the start: the start was with the MCU already, and
// nobody told it that there was nothing to do any more.
TEST_P(Regressions, StopAtTheTickOfTheStart) {
  Lab lab(hall(1, 1, GetParam()));
  lab.connect();
  std::int64_t stands = 0;
  for (double after_s = 0.060; after_s < 0.080; after_s += 0.001) {
    const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {500});
    lab.run_for(after_s);
    lab.wait(lab.send(command_t::STOP, {"m01"}));
    const reply_t result = lab.wait(move);
    EXPECT_EQ(result.result, "stopped") << "after " << after_s << " s: " << result.reason;
    lab.run_for(1);
    EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0)) << "after " << after_s << " s";
    EXPECT_LE(lab.shaft_steps("m01"), stands + 1);
    stands = lab.shaft_steps("m01");
  }
}

// A stop before the start that is lost on the way: the move has begun by the time that a second one
// is planned, so there is something to run down from.
TEST_P(Regressions, LostStopBeforeTheStart) {
  Lab lab(hall(1, 1, GetParam()));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5000});
  lab.run_for(0.060);
  int lost = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return ++lost > 2; };
  EXPECT_EQ(lab.wait(lab.send(command_t::STOP, {"m01"})).result, "done");
  const reply_t result = lab.wait(move);
  EXPECT_EQ(result.result, "stopped") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_LT(lab.shaft_steps("m01"), 5000);
}

// A line that is silent from before a short move until after its end: nothing of the move was sent,
// or nothing arrived. The motor did not move, and that is what the result says.
TEST_P(Regressions, ShortMoveOnASilentLineDidNotStart) {
  for (const double silence_s : {0.2, 0.3, 0.4}) {
    Lab lab(hall(1, 4, GetParam()));
    lab.connect();
    lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
    const auto first = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {7});
    lab.run_for(0.03);
    const auto second = lab.send(command_t::MOVE_RELATIVE, {"m02"}, {-1});
    lab.run_for(silence_s);
    lab.on_send = nullptr;
    for (const auto move : {first, second}) {
      const reply_t result = lab.wait(move);
      EXPECT_EQ(result.result, "link") << result.reason;
    }
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
    EXPECT_EQ(lab.shaft_steps("m02"), 0);
    lab.connect();
    EXPECT_EQ(lab.motor("m01").trust, "known");
    EXPECT_EQ(lab.motor("m02").trust, "known");
  }
}

// A move starts where the motor stands, and while that is being changed nobody knows.
TEST_P(Regressions, MoveWhileThePositionIsBeingSet) {
  Lab lab(hall(1, 1, GetParam()));
  lab.connect();
  const auto set = lab.send(command_t::SET_POSITION, {"m01"}, {1000});
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5});
  EXPECT_EQ(lab.last_reply(move).result, "refused");
  EXPECT_THAT(lab.last_reply(move).reason, testing::HasSubstr("being set"));
  EXPECT_EQ(lab.last_reply(lab.send(command_t::SET_POSITION, {"m01"}, {3})).result, "refused");
  EXPECT_EQ(lab.wait(set).result, "done");
  EXPECT_EQ(lab.wait(lab.send(command_t::MOVE_ABSOLUTE, {"m01"}, {1005})).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 5);
}

TEST_P(Regressions, MoveWhileDriversAreBeingDisabled) {
  Lab lab(hall(1, 2, GetParam()));
  lab.connect();
  const auto disable = lab.send(command_t::DISABLE, {"m02"});
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m01"}, {5});
  EXPECT_EQ(lab.last_reply(move).result, "refused");
  EXPECT_THAT(lab.last_reply(move).reason, testing::HasSubstr("being disabled"));
  EXPECT_EQ(lab.wait(disable).result, "done");
}

}  // namespace
}  // namespace bushd::test
