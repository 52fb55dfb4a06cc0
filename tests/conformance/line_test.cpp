// Motors of two MCUs on one line: an image beside its virtual twin, told the same run. So the twins
// are also what a line of two MCUs is: their motors make the same steps in the same slots.
#include <algorithm>
#include <random>
#include <vector>

#include "conformance/script.h"

namespace bushd::sim::line_test {
namespace {

constexpr std::uint32_t kLongest = 400;
const std::vector<bushd_line_entry> kEntries = {
    {1, 1, 400}, {6, -1, 399}, {9, 1, 137}, {15, -1, 3}};

class LineScript : public TargetScript {
 protected:
  void SetUp() override {
    for (const bushd_line_entry& entry : kEntries) motors_.push_back(own(entry.motor));
  }

  // The last SYNC tells the time of one that was a few ticks ago.
  void tell_time() {
    for (int i = 0; i < 2; ++i) {
      master_.discipline(kVirtual);
      pass_ticks(3);
    }
  }

  void begin_line(std::uint32_t from = 0, std::uint16_t shortest_delay = 0) {
    begin({0, false, shortest_delay, kLongest, from, kLongest - from, 0, nullptr}, kEntries);
  }
  void begin_elementary() {
    std::uint32_t sum = 0;
    for (const bushd_line_entry& entry : kEntries) sum += entry.increment;
    begin({0, true, 0, sum, 0, sum, 0, nullptr}, kEntries);
  }
  void begin(const bushd_line_part& line, const std::vector<bushd_line_entry>& entries) {
    tell_time();
    bushd_line_run message{};
    message.first_tick = master_.poll(kReal).tick + 40;
    message.line = line;
    tell(BUSHD_MSG_LINE_RUN, payload_of([&](std::uint8_t* to) {
           return bushd_encode_line_run(&message, entries.data(),
                                        static_cast<std::uint8_t>(entries.size()), to);
         }));
  }

  // The same number of steps at the same times, and alike for all motors to half a slot.
  void expect_alike() { Script::expect_alike(motors_); }

  std::vector<std::uint8_t> motors_;
};
BUSHD_FOR_TARGETS(LineScript, targets_with(BUSHD_CAN_LINE_RUN));

class DeniedLine : public LineScript {};
BUSHD_FOR_TARGETS(DeniedLine, targets_without(BUSHD_CAN_LINE_RUN));

class ElementaryLine : public LineScript {};
BUSHD_FOR_TARGETS(ElementaryLine, targets_with(BUSHD_CAN_ELEMENTARY));

class DeniedElementaryLine : public LineScript {};
BUSHD_FOR_TARGETS(DeniedElementaryLine, targets_without(BUSHD_CAN_ELEMENTARY));

class LineByScratchTable : public LineScript {};
BUSHD_FOR_TARGETS(LineByScratchTable, targets_with(BUSHD_CAN_LINE_RUN | BUSHD_CAN_SCRATCH));

TEST_P(DeniedLine, IsRefusedAndNothingMoves) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  const std::size_t before = steps(1, 1).size();
  begin_line();
  pass_ticks(60);
  EXPECT_EQ(master_.poll(kReal).last_rejection, BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(master_.acknowledged(kReal, BUSHD_MSG_LINE_TRIGGER, Bytes(26)),
            BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(steps(1, 1).size(), before);
}

TEST_P(LineScript, EveryStepIsInTheSlotOfTheTwins) {
  for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
    ASSERT_NO_FATAL_FAILURE(make_ready(format, motors_));
    const std::size_t before = steps(0, 1).size();
    begin_line();
    pass_ticks(60);
    EXPECT_EQ(master_.poll(kReal).running, 1u << 1 | 1u << 6 | 1u << 9 | 1u << 15);
    pass_ticks(170);
    EXPECT_EQ(steps(0, 1).size(), before + kLongest);
    expect_alike();
    // The rest of one, slowly.
    begin_line(300, kCruise + 37);
    pass_ticks(140);
    EXPECT_EQ(steps(0, 1).size(), before + 2 * kLongest - 300);
    expect_alike();
  }
}

// Each step of the run is one of one motor: as the twin makes it, which tests of its core hold to
// the printed function.
TEST_P(ElementaryLine, EveryStepIsInTheSlotOfTheTwins) {
  for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
    ASSERT_NO_FATAL_FAILURE(make_ready(format, motors_));
    const std::size_t before = steps(0, 1).size();
    begin_elementary();
    pass_ticks(60);
    EXPECT_EQ(master_.poll(kReal).running, 1u << 1 | 1u << 6 | 1u << 9 | 1u << 15);
    pass_ticks(400);
    EXPECT_EQ(steps(0, 1).size(), before + 400);
    EXPECT_EQ(steps(0, 15).size() % 3, 0u);
    expect_alike();
  }
}

TEST_P(DeniedElementaryLine, IsRefusedAndNothingMoves) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  const std::size_t before = steps(1, 1).size();
  begin_elementary();
  pass_ticks(60);
  const bool no_lines = (real_->twin().disabled_capabilities & BUSHD_CAN_LINE_RUN) != 0;
  EXPECT_EQ(master_.poll(kReal).last_rejection,
            no_lines ? BUSHD_E_UNKNOWN_MESSAGE : BUSHD_E_FORMAT);
  EXPECT_EQ(steps(1, 1).size(), before);
}

// By a table that is not kept, between lines by the one that is.
TEST_P(LineByScratchTable, MakesTheSameSteps) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  std::vector<std::uint16_t> slower = codes_;
  for (std::uint16_t& code : slower) code = static_cast<std::uint16_t>(code * 7 / 6);
  for (int i = 0; i < 3; ++i) {
    for (const std::uint8_t address : {kVirtual, kReal}) {
      ASSERT_NO_FATAL_FAILURE(
          master_.upload_table(address, BUSHD_SCRATCH_BANK, kUnitNs, slower, kCruise + 9));
    }
    begin({BUSHD_SCRATCH_BANK, false, 0, kLongest, 0, kLongest, 0, nullptr}, kEntries);
    pass_ticks(300);
    begin_line();
    pass_ticks(230);
    EXPECT_EQ(steps(0, 1).size(), static_cast<std::size_t>(i + 1) * 2 * kLongest);
    expect_alike();
    slower.push_back(kCruise + 10);
  }
}

// Numbers of all lengths: of steps, and of what two steps of a motor are apart.
TEST_P(LineScript, IsTheSameFarAlongALongLine) {
  struct Long {
    std::uint32_t longest;
    std::uint32_t from;
    std::vector<std::uint32_t> increments;
  };
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  for (const Long& line : std::vector<Long>{
           {INT32_MAX, INT32_MAX - 440, {INT32_MAX, INT32_MAX - 1, 1'431'655'765, 8'300'000}},
           {20'000'000, (1u << 24) - 200, {19'999'981, 13'000'007, 158'000, 155'000}},
           {70'000, (1u << 16) - 150, {69'000, 35'001, 547, 183}}}) {
    SCOPED_TRACE(line.longest);
    std::vector<bushd_line_entry> entries = kEntries;
    for (std::size_t i = 0; i < entries.size(); ++i) entries[i].increment = line.increments[i];
    // The clocks need not be as far apart as in the line before.
    recorder_.edges.clear();
    begin({0, false, 0, line.longest, line.from, 400, 0, nullptr}, entries);
    pass_ticks(240);
    EXPECT_EQ(master_.poll(kReal).moving, 0);
    EXPECT_GT(steps(0, 6).size(), 190u);
    expect_alike();
  }
}

TEST_P(LineScript, ItsEndIsTheSame) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  begin_line();
  pass_ticks(120);
  // Within one tick for both.
  bus_.advance_to(bus_.node(0).next_event_ns());
  master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_EMERGENCY, Bytes{BUSHD_STOP_RAMP});
  pass_ticks(100);
  EXPECT_LT(steps(0, 1).size(), kLongest);
  EXPECT_EQ(master_.poll(kReal).moving, 0);
  expect_alike();
}

// All MCUs go by the same time: that which the last SYNC has told.
TEST_P(LineScript, SilenceEndsItInTheSameTick) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, motors_));
  const bushd_configure short_timeout = {tick_ns_, BUSHD_FORMAT_FINE, 100};
  ASSERT_NO_FATAL_FAILURE(ask(short_timeout));
  begin_line();
  pass_ticks(250);
  EXPECT_LT(steps(0, 1).size(), kLongest);
  EXPECT_GT(steps(0, 1).size(), 0u);
  EXPECT_EQ(master_.poll(kReal).faults, BUSHD_FAULT_LINK);
  expect_alike();
}

// When the steps of a motor are due, counted from the run's beginning: by the codes of the table
// and the statement of the protocol.
std::vector<TimeNs> due_times(std::uint32_t increment, std::uint16_t shortest_delay) {
  const std::vector<std::uint16_t> codes = ramp();
  std::vector<TimeNs> ends{0};  // of the run's steps
  for (std::size_t j = 1; j <= kLongest; ++j) {
    std::uint16_t delay = std::max(kCruise, shortest_delay);
    if (j <= codes.size()) delay = std::max(delay, codes[j - 1]);
    if (kLongest - j < codes.size()) delay = std::max(delay, codes[kLongest - j]);
    ends.push_back(ends.back() + TimeNs{delay} * kUnitNs);
  }
  std::vector<TimeNs> times;
  for (std::uint64_t j = 1; j <= increment; ++j) {
    const std::uint64_t parts = (128 * (2 * j - 1) * kLongest + increment - 1) / increment + 128;
    const std::size_t step = (parts - 1) / 256;
    const auto part = static_cast<TimeNs>(parts - 256 * step);
    times.push_back(ends[step] + (ends[step + 1] - ends[step]) * part / 256);
  }
  return times;
}

// Counted from the edge; the clocks are the bus's.
TEST_P(LineScript, TriggeredEveryStepIsWithinASlotOfItsTime) {
  constexpr TimeNs kSlotNs = kTickNs / 128;
  std::mt19937 random(8);
  for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
    ASSERT_NO_FATAL_FAILURE(make_ready(format, motors_));
    const auto number = static_cast<std::uint8_t>(format + 1);
    const auto shortest_delay =
        static_cast<std::uint16_t>(format == BUSHD_FORMAT_FINE ? 0 : kCruise + 11);
    const auto delay_us = static_cast<std::uint32_t>(50 + random() % 20'000);
    const bushd_line_trigger message{number,
                                     BUSHD_EDGE_RISING,
                                     delay_us,
                                     {0, false, shortest_delay, kLongest, 0, kLongest, 0, nullptr}};
    const Bytes payload = payload_of([&](std::uint8_t* to) {
      return bushd_encode_line_trigger(&message, kEntries.data(),
                                       static_cast<std::uint8_t>(kEntries.size()), to);
    });
    ASSERT_NO_FATAL_FAILURE(ask(BUSHD_MSG_LINE_TRIGGER, payload));
    tell_time();
    EXPECT_EQ(master_.poll(kReal).armed, 1u << 1 | 1u << 6 | 1u << 9 | 1u << 15);
    EXPECT_EQ(master_.poll(kReal).moving, 0);
    bus_.advance_to(bus_.now_ns() + static_cast<TimeNs>(random() % (2 * kTickNs)));
    set_inputs({0, BUSHD_INPUT_TRIGGER});
    const TimeNs edge_ns = bus_.now_ns();
    pass_ticks(300);
    set_inputs({0, 0});
    EXPECT_EQ(master_.poll(kReal).trigger_state, BUSHD_TRIGGER_STARTED);
    expect_the_same_reports();
    for (const bushd_line_entry& entry : kEntries) {
      const std::vector<TimeNs> due = due_times(entry.increment, shortest_delay);
      for (const std::size_t mcu : {0, 1}) {
        SCOPED_TRACE("motor " + std::to_string(entry.motor) + (mcu == 0 ? " virtual" : " real"));
        std::vector<Step> made = steps(mcu, entry.motor);
        std::erase_if(made, [&](const Step& step) { return step.time_ns < edge_ns; });
        ASSERT_EQ(made.size(), due.size());
        for (std::size_t i = 0; i < due.size(); ++i) {
          const TimeNs expected_ns =
              edge_ns + 3 * TimeNs{kTickNs} + TimeNs{delay_us} * 1000 + due[i];
          ASSERT_LE(std::abs(made[i].time_ns - expected_ns), kSlotNs + 5'000) << "step " << i;
          ASSERT_EQ(made[i].positive, entry.direction > 0);
        }
      }
    }
  }
}

}  // namespace
}  // namespace bushd::sim::line_test
