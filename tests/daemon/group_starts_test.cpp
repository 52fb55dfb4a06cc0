// Motors of several MCUs that begin together, whatever frame is lost: all of them begin, in one
// tick, or none does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/lab.h"
#include "daemon/line_times.h"
#include "daemon/lost_frames.h"
#include "engine/frame.h"
#include "sim/edge.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;
using testing::SizeIs;

// When each motor made its first step, by MCU and output.
class FirstSteps final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    at_ns_.try_emplace({edge.mcu, edge.index}, edge.time_ns);
  }
  void settled(sim::TimeNs) override {}

  void forget() { at_ns_.clear(); }
  std::vector<sim::TimeNs> times() const {
    std::vector<sim::TimeNs> times;
    for (const auto& [motor, at_ns] : at_ns_) times.push_back(at_ns);
    return times;
  }

 private:
  std::map<std::pair<std::size_t, unsigned>, sim::TimeNs> at_ns_;
};

// A byte is wrong in one frame of all that the line carries, in either direction.
class OneFrameIsLost {
 public:
  OneFrameIsLost(Lab& lab, int frame) : frame_(frame) {
    lab.on_send = [this](std::size_t, std::vector<std::uint8_t>& bytes) {
      for (std::uint8_t& byte : bytes) pass(to_mcus_, byte);
      return true;
    };
    lab.on_receive = [this](std::size_t, std::uint8_t& byte) { pass(from_mcus_, byte); };
  }
  int frames() const { return frames_; }

 private:
  struct Direction {
    bool in_frame = false;
    bool lost = false;
  };
  void pass(Direction& direction, std::uint8_t& byte) {
    if (byte == 0) {
      direction = {};
      return;
    }
    if (!direction.in_frame) direction = {.in_frame = true, .lost = frames_++ == frame_};
    if (direction.lost) byte = byte == 1 ? 2 : 1;
  }

  const int frame_;
  int frames_ = 0;
  Direction to_mcus_;
  Direction from_mcus_;
};

struct Group {
  const char* name;
  const char* manner;
  int mcus;
  int motors;  // of each MCU
  bool line;
};

class GroupStarts : public testing::TestWithParam<Group> {
 protected:
  GroupStarts() { lab.connect(); }

  std::vector<std::string> motors() const {
    std::vector<std::string> names;
    for (int m = 1; m <= GetParam().mcus * GetParam().motors; ++m) {
      names.push_back((m < 10 ? "m0" : "m") + std::to_string(m));
    }
    return names;
  }
  std::int64_t ask(std::int64_t steps) {
    const std::vector<std::string> names = motors();
    const std::vector<std::int64_t> all(names.size(), steps);
    if (!GetParam().line) return lab.send(Ask::kMoveBy, names, all);
    return lab.send(api::MoveLine{.motors = motor_steps(names, all)});
  }
  void expect_one_beginning() const {
    ASSERT_THAT(first.times(), SizeIs(motors().size()));
    // Ticks are 2.56 ms, and an MCU that is out by half of one is no more in step.
    constexpr sim::TimeNs kHalfATick = 1'280'000;
    const sim::TimeNs at = first.times().front();
    EXPECT_THAT(first.times(), Each(AllOf(Gt(at - kHalfATick), Lt(at + kHalfATick))));
  }
  void forget() {
    lab.on_send = nullptr;
    lab.on_receive = nullptr;
  }

  FirstSteps first;
  Lab lab{hall(GetParam().mcus, GetParam().motors, GetParam().manner), {}, &first};
};

// Each frame in turn, from the request until the motors move.
TEST_P(GroupStarts, NoLostFrameSplitsThem) {
  int frames = 1;
  for (int lost = 0; lost < frames; ++lost) {
    SCOPED_TRACE(lost);
    first.forget();
    OneFrameIsLost line(lab, lost);
    const auto move = ask(lost % 2 == 0 ? 5 : -5);
    EXPECT_TRUE(lab.run_until([&] { return !first.times().empty(); }, 1));
    frames = std::max(frames, line.frames());
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "reached") << result.reason;
    forget();
    lab.run_for(0.02);
    expect_one_beginning();
    for (const std::string& motor : motors()) {
      EXPECT_EQ(lab.shaft_steps(motor), lost % 2 == 0 ? 5 : 0) << motor;
    }
  }
  EXPECT_GT(frames, 2 * GetParam().mcus) << "first frames, the question and its answers";
}

// An MCU that cannot be told begins with the others, later.
TEST_P(GroupStarts, WhatOneMcuDoesNotGetIsWithdrawnFromAll) {
  const auto late = [this] {
    return testing::Value(lab.move_lines(), Contains(HasSubstr("\"late\"")));
  };
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    bytes = without(bytes, [&](const bushd_frame& frame) {
      const bool begins = frame.type == BUSHD_MSG_TABLE_TICKS ||
                          frame.type == BUSHD_MSG_TABLE_RUN || frame.type == BUSHD_MSG_LINE_RUN;
      return begins && frame.address == GetParam().mcus && !late();
    });
    return true;
  };
  const Answer result = lab.wait(ask(5));
  forget();
  EXPECT_TRUE(late());
  EXPECT_EQ(result.result, "reached") << result.reason;
  expect_one_beginning();
}

struct Lead {
  const char* name;
  int mcus;
  int motors;
  bool line;
};

class StartLead : public testing::TestWithParam<Lead> {};

// What a start of these takes at most, as docs/decisions/0080-starts.md has it. A poll may have
// begun just before the request, at rest one whose answers take 5 ms; then go the first frames. 2
// ms are the program's, a tick is what its clock may lag by, and two are what an MCU needs. What
// takes several frames is confirmed by one poll, after which there is time for a frame of rest, of
// one tick, to each MCU, and for a tick in which that is decided.
std::int64_t longest_lead_us(const Lead& lead) {
  const auto motors = static_cast<std::size_t>(lead.motors);
  const std::int64_t most_asked = (5'000 + 530) / (hall_line_us(kAnswerAtRest) + 530);
  const std::int64_t poll_us =
      hall_poll_us(std::min(lead.mcus, static_cast<int>(most_asked)), kAnswerAtRest);
  const std::int64_t frames_us =
      lead.mcus * hall_line_us(BUSHD_TABLE_TICKS_HEADER + motors * BUSHD_TABLE_TICKS_MAX_ENTRY);
  const std::int64_t at_once_us = poll_us + frames_us + 2'000 + 3 * kHallTickUs;
  if (lead.mcus == 1 && lead.motors == 1) return at_once_us;
  constexpr std::size_t kDelayAndTick = 2 + 2;
  return at_once_us + hall_poll_us(lead.mcus, answer_in_motion(lead.motors)) +
         lead.mcus * hall_line_us(BUSHD_TICKS_HEADER + motors * kDelayAndTick) + kHallTickUs;
}

// From the request to the beginning, at any phase of the polls.
TEST_P(StartLead, IsTheTimeOfFramesAndOneExchange) {
  const auto& [name, mcus, motors, line] = GetParam();
  FirstSteps first;
  ReadyLab lab(hall(mcus, motors), {}, &first);
  std::vector<std::string> names;
  for (int m = 1; m <= mcus * motors; ++m) names.push_back("m0" + std::to_string(m));
  std::int64_t longest_us = 0;
  for (int phase = 0; phase < 60; ++phase) {
    SCOPED_TRACE(phase);
    lab.run_for(0.1 + phase * 0.000873);
    first.forget();
    const std::int64_t asked_us = lab.now_us();
    const std::vector<std::int64_t> steps(names.size(), phase % 2 == 0 ? 4 : -4);
    const auto move = line ? lab.send(api::MoveLine{.motors = motor_steps(names, steps)})
                           : lab.send(Ask::kMoveBy, names, steps);
    ASSERT_EQ(lab.wait(move).result, "reached");
    constexpr std::int64_t kFirstDelayUs = 10'000;
    const std::int64_t lead_us = first.times().front() / 1000 - kFirstDelayUs - asked_us;
    longest_us = std::max(longest_us, lead_us);
  }
  EXPECT_LE(longest_us, longest_lead_us(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Groups, StartLead,
                         testing::Values(Lead{"one", 1, 1, false}, Lead{"of_one_mcu", 1, 4, false},
                                         Lead{"two_mcus", 2, 1, false},
                                         Lead{"line_of_two_mcus", 2, 1, true},
                                         Lead{"eight_mcus", 8, 1, false}),
                         [](const auto& tested) { return std::string(tested.param.name); });

INSTANTIATE_TEST_SUITE_P(Groups, GroupStarts,
                         testing::Values(Group{"pair", "fine", 2, 1, false},
                                         Group{"runs", "fine_table", 2, 2, false},
                                         Group{"coarse", "coarse", 3, 2, false},
                                         Group{"many", "fine", 1, 16, false},
                                         Group{"line", "fine", 2, 2, true},
                                         Group{"line_of_runs", "coarse_table", 3, 1, true}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace bushd::test
