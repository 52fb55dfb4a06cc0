// Programs as a test writes them, byte by byte, and what pins must show of one: a plain walk over
// its frames, with the step times of the slow reference.
#pragma once

#include <array>
#include <cstdlib>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "firmware/line_runs.h"

namespace bushd::test {

// Codes of docs/protocol.md.
enum class Kind : std::uint8_t {
  kEnd = 0,
  kMoveTo = 1,
  kMoveBy = 2,
  kLineTo = 3,
  kLineBy = 4,
  kWait = 5,
  kWaitInput = 6,
  kPulse = 7,
  kRepeat = 8,
  kNext = 9,
  kTravel = 10,
  kMoveUntil = 11
};

struct ProgramFrame {
  Kind kind = Kind::kEnd;
  std::vector<std::uint8_t> motors{};           // rising
  std::vector<std::vector<std::int32_t>> to{};  // by point, then by motor
  std::uint16_t shortest_delay = 0;
  std::uint32_t us = 0;
  std::uint8_t input = 0;
  bool level = true;
  std::uint16_t count = 0;
  bool elementary = false;  // of a line
  std::uint8_t bank = 0;
  std::uint8_t edge = 0;
  std::uint32_t delay_us = 0;
  std::uint32_t after = 0;  // steps
};

struct ProgramText {
  std::uint8_t flags = 0;
  std::uint16_t motors = 0xF;
  std::int32_t least = -100'000;
  std::int32_t most = 100'000;
  std::vector<ProgramFrame> frames{};
};

inline const ProgramFrame kProgramEnd{};
inline ProgramFrame wait_us(std::uint32_t us) {
  return {.kind = Kind::kWait, .us = us};
}

inline void append(Bytes& bytes, std::uint64_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

inline Bytes bytes_of(const ProgramText& text) {
  Bytes bytes = {1, text.flags};
  append(bytes, text.motors, 2);
  for (unsigned m = 0; m < 16; ++m) {
    if ((text.motors >> m & 1u) == 0) continue;
    bytes.push_back(0);
    append(bytes, static_cast<std::uint32_t>(text.least), 4);
    append(bytes, static_cast<std::uint32_t>(text.most), 4);
  }
  for (const ProgramFrame& frame : text.frames) {
    bytes.push_back(static_cast<std::uint8_t>(frame.kind));
    unsigned mask = 0;
    for (const std::uint8_t motor : frame.motors) mask |= 1u << motor;
    const bool line = frame.kind == Kind::kLineTo || frame.kind == Kind::kLineBy;
    switch (frame.kind) {
      case Kind::kMoveTo:
      case Kind::kMoveBy:
      case Kind::kLineTo:
      case Kind::kLineBy:
        append(bytes, mask, 2);
        if (line) {
          bytes.push_back(static_cast<std::uint8_t>(frame.bank | (frame.elementary ? 0x80 : 0)));
          append(bytes, frame.shortest_delay, 2);
          append(bytes, frame.to.size(), 2);
        }
        for (const auto& point : frame.to) {
          for (const std::int32_t steps : point) {
            append(bytes, static_cast<std::uint32_t>(steps), 4);
            if (!line) append(bytes, frame.shortest_delay, 2);
          }
        }
        break;
      case Kind::kMoveUntil:
        append(bytes, mask, 2);
        bytes.push_back(frame.input);
        bytes.push_back(frame.level ? 1 : 0);
        append(bytes, frame.after, 4);
        append(bytes, static_cast<std::uint32_t>(frame.to.at(0).at(0)), 4);
        append(bytes, frame.shortest_delay, 2);
        break;
      case Kind::kTravel:
        append(bytes, mask, 2);
        bytes.push_back(frame.bank);
        bytes.push_back(frame.edge);
        append(bytes, frame.delay_us, 4);
        append(bytes, frame.us, 4);
        append(bytes, static_cast<std::uint32_t>(frame.to.at(0).at(0)), 4);
        break;
      case Kind::kWait:
      case Kind::kPulse:
        append(bytes, frame.us, 4);
        break;
      case Kind::kWaitInput:
        bytes.push_back(frame.input);
        bytes.push_back(frame.level ? 1 : 0);
        append(bytes, frame.us, 4);
        break;
      case Kind::kRepeat:
        append(bytes, frame.count, 2);
        break;
      default:
        break;
    }
  }
  return bytes;
}

// A step of a motor, by tick and slot.
struct MadeStep {
  std::uint32_t tick;
  std::uint16_t slot;
  std::uint8_t motor;
  bool positive;
  friend auto operator<=>(const MadeStep&, const MadeStep&) = default;
};

// What the pins must show of a program that nothing disturbs.
class ProgramWalk {
 public:
  ProgramWalk(Law law, std::uint32_t tick_ns, std::uint16_t slots)
      : law_(std::move(law)), tick_ns_(tick_ns), slots_(slots) {}

  void run(const ProgramText& text, std::uint32_t first_tick) {
    tick_ = first_tick;
    begun_ = 0;
    carry_out(text.frames, 0);
  }
  std::uint32_t end_tick() const { return tick_; }
  const std::set<MadeStep>& steps() const { return steps_; }
  const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pulses() const { return pulses_; }
  std::array<std::int64_t, 16> at{};

 private:
  static constexpr int kBeginsInATick = 8;

  void later(std::uint32_t ticks) {
    tick_ += ticks;
    if (ticks != 0) begun_ = 0;
  }
  void begin() {
    if (begun_ == kBeginsInATick) later(1);
    ++begun_;
  }

  // From frame i on, until the NEXT or END that belongs to it; returns where that is.
  std::size_t carry_out(const std::vector<ProgramFrame>& frames, std::size_t i) {
    for (;; ++i) {
      const ProgramFrame& frame = frames.at(i);
      begin();
      switch (frame.kind) {
        case Kind::kEnd:
        case Kind::kNext:
          return i;
        case Kind::kRepeat: {
          std::size_t end = i;
          for (int pass = 0; pass < frame.count; ++pass) end = carry_out(frames, i + 1);
          i = end;
          break;
        }
        case Kind::kWait:
          later(static_cast<std::uint32_t>((std::uint64_t{frame.us} * 1000 + tick_ns_ - 1) /
                                           tick_ns_));
          break;
        case Kind::kPulse:
          pulses_.emplace_back(tick_, frame.us);
          break;
        case Kind::kMoveTo:
        case Kind::kMoveBy:
          move(frame);
          break;
        default:
          for (std::size_t point = 0; point < frame.to.size(); ++point) {
            if (point != 0) begin();
            line(frame, frame.to[point]);
          }
      }
    }
  }

  std::int64_t way_of(const ProgramFrame& frame, std::size_t i,
                      const std::vector<std::int32_t>& to) const {
    const bool relative = frame.kind == Kind::kMoveBy || frame.kind == Kind::kLineBy;
    return relative ? to[i] : to[i] - at[frame.motors[i]];
  }
  std::uint32_t ticks_of(const Reference& run) const {
    if (run.steps() == 0) return 0;
    const Wide tick = Wide{tick_ns_} * 256;
    return static_cast<std::uint32_t>((run.step(run.steps() - 1).end + tick - 1) / tick);
  }
  void make(std::uint8_t motor, bool positive, Wide after) {
    const Wide length = Wide{tick_ns_} * 256;
    const Wide ticks = (after + length - 1) / length - 1;
    const Wide slot = std::min<Wide>((after - ticks * length) * slots_ / length, slots_ - 1);
    steps_.insert({tick_ + static_cast<std::uint32_t>(ticks), static_cast<std::uint16_t>(slot),
                   motor, positive});
    at[motor] += positive ? 1 : -1;
  }
  void move(const ProgramFrame& frame) {
    std::uint32_t ticks = 0;
    for (std::size_t i = 0; i < frame.motors.size(); ++i) {
      const std::int64_t way = way_of(frame, i, frame.to.at(0));
      const auto run =
          Reference::move(law_, static_cast<std::size_t>(std::abs(way)), frame.shortest_delay);
      for (std::size_t j = 0; j < run.steps(); ++j) {
        make(frame.motors[i], way > 0, run.step(j).end);
      }
      ticks = std::max(ticks, ticks_of(run));
    }
    later(ticks);
  }
  void elementary_line(const ProgramFrame& frame, const std::vector<std::int32_t>& to) {
    std::vector<LineMotor> motors;
    std::size_t sum = 0;
    for (std::size_t i = 0; i < frame.motors.size(); ++i) {
      const auto way = static_cast<std::int32_t>(way_of(frame, i, to));
      if (way == 0) continue;
      motors.push_back({frame.motors[i], way});
      sum += length(way);
    }
    if (sum == 0) return;
    const auto run = Reference::move(law_, sum, frame.shortest_delay);
    const auto times = elementary_times_of(run, motors);
    for (std::size_t i = 0; i < motors.size(); ++i) {
      for (const Wide after : times[i]) make(motors[i].number, motors[i].steps > 0, after);
    }
    later(ticks_of(run));
  }
  void line(const ProgramFrame& frame, const std::vector<std::int32_t>& to) {
    if (frame.elementary) return elementary_line(frame, to);
    std::vector<std::int64_t> ways;
    std::int64_t longest = 0;
    for (std::size_t i = 0; i < frame.motors.size(); ++i) {
      ways.push_back(way_of(frame, i, to));
      longest = std::max(longest, std::abs(ways.back()));
    }
    if (longest == 0) return;
    const auto run = Reference::move(law_, static_cast<std::size_t>(longest), frame.shortest_delay);
    for (std::size_t i = 0; i < frame.motors.size(); ++i) {
      if (ways[i] == 0) continue;
      for (const Wide after : times_of(run, static_cast<std::uint32_t>(std::abs(ways[i])),
                                       static_cast<std::uint32_t>(longest))) {
        make(frame.motors[i], ways[i] > 0, after);
      }
    }
    later(ticks_of(run));
  }

  Law law_;
  std::uint32_t tick_ns_;
  std::uint16_t slots_;
  std::uint32_t tick_ = 0;
  int begun_ = 0;
  std::set<MadeStep> steps_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pulses_;  // tick, width
};

// A READY MCU that is asked for programs.
class Programs : public OfLines {
 protected:
  using OfLines::OfLines;

  static bushd_status put(Rig& on, const Bytes& part, std::size_t offset, std::size_t total) {
    Bytes payload;
    append(payload, offset, 2);
    append(payload, total, 2);
    payload.insert(payload.end(), part.begin(), part.end());
    return on.request(BUSHD_MSG_PROGRAM_PUT, payload);
  }
  static bushd_status commit(Rig& on, const Bytes& bytes) {
    return control(on, BUSHD_PROGRAM_COMMIT, 0, crc32(bytes));
  }
  static bushd_status control(Rig& on, std::uint8_t action, std::uint8_t number,
                              std::uint32_t value) {
    Bytes payload = {action, number};
    append(payload, value, 4);
    return on.request(BUSHD_MSG_PROGRAM, payload);
  }
  bushd_status put(const Bytes& part, std::size_t offset, std::size_t total) {
    return put(rig, part, offset, total);
  }
  bushd_status upload(const Bytes& bytes, std::size_t part = 100) {
    for (std::size_t at = 0; at < bytes.size(); at += part) {
      const std::size_t size = std::min(part, bytes.size() - at);
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      const bushd_status status =
          put(Bytes(begin, begin + static_cast<std::ptrdiff_t>(size)), at, bytes.size());
      if (status != BUSHD_OK) return status;
    }
    return BUSHD_OK;
  }
  bushd_status control(std::uint8_t action, std::uint8_t number = 0, std::uint32_t value = 0) {
    return control(rig, action, number, value);
  }
  bushd_status commit(const Bytes& bytes) { return commit(rig, bytes); }
  bushd_status load(const ProgramText& text) {
    const Bytes bytes = bytes_of(text);
    const bushd_status status = upload(bytes);
    return status == BUSHD_OK ? commit(bytes) : status;
  }
  bushd_status start(std::uint32_t first_tick) {
    return control(BUSHD_PROGRAM_RUN, ++number_, first_tick);
  }
  void begin(const ProgramText& text) {
    ASSERT_EQ(load(text), BUSHD_OK);
    ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  }
  bushd_program_state state() {
    rig.frame(BUSHD_MSG_PROGRAM_STATE, {});
    const auto got = rig.answer();
    bushd_program_state state{};
    EXPECT_TRUE(got);
    if (!got) return state;
    EXPECT_EQ(bushd_decode_program_state(got->payload.data(), got->payload.size(), &state),
              BUSHD_OK);
    return state;
  }

  // The tick that is being emitted, and on to the next one.
  void pass() {
    const bushd_slot_buffer& buffer = rig.slot_buffer();
    for (std::uint16_t slot = 0; slot < rig.options().slots; ++slot) {
      for (std::uint8_t m = 0; buffer.active != 0 && m < rig.options().motors; ++m) {
        if ((buffer.step[slot] >> m & 1u) == 0) continue;
        made.insert({rig.tick(), slot, m, (buffer.direction >> m & 1u) != 0});
      }
    }
    if (buffer.compare_rise != 0) rises.emplace_back(rig.tick(), buffer.compare_rise - 1);
    if (buffer.compare_fall != 0) falls.emplace_back(rig.tick(), buffer.compare_fall - 1);
    rig.pass();
  }
  void pass(int ticks) {
    for (int i = 0; i < ticks; ++i) pass();
  }
  bushd_program_state pass_until_ended(int limit = 200'000) {
    while (rig.mcu().config.program->motors != 0 && --limit > 0) pass();
    EXPECT_GT(limit, 0);
    pass(3);  // what was prepared
    return state();
  }
  void expect_counted() {
    for (std::uint8_t m = 0; m < rig.options().motors; ++m) {
      EXPECT_EQ(rig.poll().motor[m].position_steps, rig.pulses(m)) << int{m};
    }
    EXPECT_EQ(rig.poll().moving, 0);
    EXPECT_EQ(rig.poll().autonomous, 0);
    EXPECT_EQ(rig.steps_with_dir(), 0);
    EXPECT_EQ(rig.steps_while_disabled(), 0);
  }
  void expect_ended(bushd_program_reason why) {
    const bushd_program_state ended = pass_until_ended();
    EXPECT_EQ(ended.stage, BUSHD_PROGRAM_ENDED);
    EXPECT_EQ(ended.reason, why);
    expect_counted();
  }

  std::set<MadeStep> made;
  std::vector<std::pair<std::uint32_t, int>> rises;  // tick, slot
  std::vector<std::pair<std::uint32_t, int>> falls;
  std::uint8_t number_ = 0;
};

}  // namespace bushd::test
