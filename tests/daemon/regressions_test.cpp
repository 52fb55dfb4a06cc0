// What tests/faults found, each reduced to the least that shows it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

// The frames of a write, each with the delimiter that ends it; a leading delimiter goes with the
// first.
std::vector<std::vector<std::uint8_t>> frames_of(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::vector<std::uint8_t>> frames(1);
  for (const std::uint8_t byte : bytes) {
    frames.back().push_back(byte);
    if (byte == 0 && frames.back().size() > 1) frames.emplace_back();
  }
  frames.pop_back();
  return frames;
}

// The ticks of a frame, if it holds ticks; `decoder` keeps their bytes.
std::optional<bushd_ticks> ticks_in(const std::vector<std::uint8_t>& wire,
                                    bushd_receiver& decoder) {
  decoder = {};
  for (const std::uint8_t byte : wire) {
    bushd_frame frame;
    bushd_ticks ticks;
    if (bushd_receive_byte(&decoder, byte, &frame) == BUSHD_RECEIVE_FRAME &&
        frame.type == BUSHD_MSG_TICKS &&
        bushd_decode_ticks(frame.payload, frame.payload_size, &ticks) == BUSHD_OK) {
      return ticks;
    }
  }
  return std::nullopt;
}

// These look at frames of ticks.
std::string every_tick(const char* format) {
  return std::string(format) + "_ticks";
}

class Regressions : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, Regressions, testing::Values("fine", "coarse"),
                         [](const auto& format) { return std::string(format.param); });

// A stop that takes effect at the very tick of the start: the start was with the MCU already, and
// nobody told it that there was nothing to do any more. What is told tick by tick starts 100 ms
// after the request.
TEST_P(Regressions, StopAtTheTickOfTheStart) {
  ReadyLab lab(hall(1, 2, GetParam() + std::string("_ticks")));
  std::int64_t stands = 0;
  for (double after_s = 0.060; after_s < 0.080; after_s += 0.001) {
    const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {500, 500});
    lab.run_for(after_s);
    lab.ask(Ask::kStop, {"m01", "m02"});
    const Answer result = lab.wait(move);
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
  ReadyLab lab(hall(1, 2, GetParam() + std::string("_ticks")));
  const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {5000, 5000});
  lab.run_for(0.060);
  int lost = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>&) { return ++lost > 2; };
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01", "m02"}).result, "done");
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "stopped") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_LT(lab.shaft_steps("m01"), 5000);
}

// A line that is silent from before a short move until after its end: nothing of the move was sent,
// or nothing arrived. The motor did not move, and begins anew.
TEST_P(Regressions, ShortMoveOnASilentLineBeginsAnew) {
  for (const double silence_s : {0.2, 0.3, 0.4}) {
    ReadyLab lab(hall(1, 4, GetParam()));
    lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
    const auto first = lab.send(Ask::kMoveBy, {"m01"}, {7});
    lab.run_for(0.03);
    const auto second = lab.send(Ask::kMoveBy, {"m02"}, {-1});
    lab.run_for(silence_s);
    lab.on_send = nullptr;
    for (const auto move : {first, second}) {
      const Answer result = lab.wait(move);
      EXPECT_EQ(result.result, "reached") << result.reason;
    }
    EXPECT_EQ(lab.shaft_steps("m01"), 7);
    EXPECT_EQ(lab.shaft_steps("m02"), -1);
    lab.connect();
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown);
  }
}

// A move starts where the motor stands, and while that is being changed nobody knows.
TEST_P(Regressions, MoveWhileThePositionIsBeingSet) {
  ReadyLab lab(hall(1, 1, GetParam()));
  const auto set = lab.send(Ask::kSetPosition, {"m01"}, {1000});
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {5});
  EXPECT_THAT(lab.last_reply(move), Ends("refused", "being set"));
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kSetPosition, {"m01"}, {3})).result, "refused");
  EXPECT_EQ(lab.wait(set).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {1005}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 5);
}

TEST_P(Regressions, MoveWhileDriversAreBeingDisabled) {
  ReadyLab lab(hall(1, 2, GetParam()));
  const auto disable = lab.send(Ask::kDisable, {"m02"});
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {5});
  EXPECT_THAT(lab.last_reply(move), Ends("refused", "being disabled"));
  EXPECT_EQ(lab.wait(disable).result, "done");
}

// A second stop while nobody knows yet whether the first was taken: its motor goes on by the plan
// that the MCU has, until its own replacement is out.
TEST_P(Regressions, StopWhileAnotherIsNotConfirmed) {
  for (const int later_ms : {1, 6, 12, 25}) {
    for (int lost = 1; lost <= 3; ++lost) {
      ReadyLab lab(hall(1, 2, every_tick(GetParam())));
      const auto first = lab.send(Ask::kMoveBy, {"m01"}, {9000});
      const auto second = lab.send(Ask::kMoveBy, {"m02"}, {9000});
      lab.run_for(1.3);
      // The first polls after the stop are lost.
      int polls = 0;
      lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
        const auto frames = frames_of(bytes);
        bytes.clear();
        for (const auto& frame : frames) {
          bushd_receiver decoder;
          if (!ticks_in(frame, decoder) && ++polls <= lost) continue;
          bytes.insert(bytes.end(), frame.begin(), frame.end());
        }
        return true;
      };
      lab.send(Ask::kStop, {"m01"});
      lab.run_for(later_ms * 1e-3);
      lab.send(Ask::kStop, {"m02"});
      EXPECT_EQ(lab.wait(first).result, "stopped") << later_ms << " ms, " << lost << " lost";
      const Answer result = lab.wait(second);
      EXPECT_EQ(result.result, "stopped") << later_ms << " ms, " << lost << " lost";
      EXPECT_EQ(lab.shaft_steps("m02"), result.position_steps.at(0));
    }
  }
}

// A stop is lost, what followed it is not, and comes once more after the second try: it must not be
// taken for what follows that.
TEST_P(Regressions, FollowersOfALostStopComeAgainAfterTheNext) {
  ReadyLab lab(hall(1, 1, every_tick(GetParam())));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {9000});
  lab.run_for(1.3);
  std::vector<std::uint8_t> followers;
  int replacements = 0;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    const auto frames = frames_of(bytes);
    bytes.clear();
    for (const auto& frame : frames) {
      bushd_receiver decoder;
      const auto ticks = ticks_in(frame, decoder);
      const bool replaces = ticks && (ticks->flags & BUSHD_TICKS_REPLACE) != 0;
      replacements += replaces;
      if (replaces && replacements == 1) continue;
      if (ticks && replacements == 1) followers.insert(followers.end(), frame.begin(), frame.end());
      bytes.insert(bytes.end(), frame.begin(), frame.end());
      if (replaces && replacements == 2) {
        bytes.insert(bytes.end(), followers.begin(), followers.end());
      }
    }
    return true;
  };
  lab.send(Ask::kStop, {"m01"});
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "stopped") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0));
  EXPECT_EQ(replacements, 2);
  EXPECT_FALSE(followers.empty());
}

// An emergency stop gives up all plans, a stop that was lost on its way among them. A report that
// was made before the MCU heard of the emergency shows steps that no plan leads to any more.
TEST_P(Regressions, EmergencyStopWhileALostStopIsNotKnownToBeLost) {
  for (int later_ms = 0; later_ms < 40; ++later_ms) {
    ReadyLab lab(hall(1, 1, every_tick(GetParam())));
    const auto move = lab.send(Ask::kMoveBy, {"m01"}, {9000});
    lab.run_for(1.3);
    lab.on_send = [](std::size_t, std::vector<std::uint8_t>&) { return false; };
    lab.send(Ask::kStop, {"m01"});
    lab.run_for(0.045);
    lab.on_send = nullptr;
    lab.run_for(later_ms * 1e-3);
    lab.send(Ask::kEmergencyStop, {});
    const Answer result = lab.wait(move);
    ASSERT_EQ(result.result, "stopped") << later_ms << " ms: " << result.reason;
    ASSERT_EQ(lab.shaft_steps("m01"), result.position_steps.at(0)) << later_ms << " ms";
  }
}

}  // namespace
}  // namespace bushd::test
