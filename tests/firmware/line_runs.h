// Motors of an MCU that follow one run along a line, and where their steps belong.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <span>
#include <vector>

#include "engine/line.h"
#include "firmware/streams.h"

namespace bushd::test {

struct LineMotor {
  std::uint8_t number;
  std::int32_t steps;  // of the whole line
};

inline std::uint32_t length(std::int32_t steps) {
  return static_cast<std::uint32_t>(std::abs(steps));
}

// When, in 1/256 ns from the run's beginning: by rational numbers, rounded up to 1/256 of a step of
// the run.
inline std::vector<Wide> times_of(const Reference& run, std::uint32_t increment,
                                  std::uint32_t longest, std::uint32_t from = 0) {
  std::vector<Wide> times;
  for (Wide j = 1; j <= increment; ++j) {
    const Wide parts = (128 * (2 * j - 1) * longest + increment - 1) / increment + 128;
    const Wide step = (parts + 255) / 256 - 1 - from;
    if (step < 0) continue;
    if (step >= static_cast<Wide>(run.steps())) break;
    const Step& running = run.step(static_cast<std::size_t>(step));
    const Wide begin = running.end - running.delay;
    times.push_back(begin + running.delay * (parts - 256 * (step + from)) / 256);
  }
  return times;
}

// By the elementary law: as many steps of each motor as F has asked for, F = a_k b - b_k a of it
// and all behind it, in the order of their numbers.
inline std::vector<std::vector<Wide>> elementary_times_of(const Reference& run,
                                                          const std::vector<LineMotor>& motors) {
  std::vector<std::vector<Wide>> times(motors.size());
  for (std::size_t s = 0; s < run.steps(); ++s) {
    std::size_t next = 0;
    for (; next + 1 < motors.size(); ++next) {
      Wide others = 0;
      Wide others_made = 0;
      for (std::size_t i = next + 1; i < motors.size(); ++i) {
        others += length(motors[i].steps);
        others_made += static_cast<Wide>(times[i].size());
      }
      const Wide own_made = static_cast<Wide>(times[next].size());
      if (Wide{length(motors[next].steps)} * others_made - others * own_made >= 0) break;
    }
    times[next].push_back(run.step(s).end);
  }
  return times;
}

// Lines of an MCU with four motors; the run is of `law`, in bank 0, as are their tables.
class OfLines : public Streams {
 protected:
  explicit OfLines(RigOptions options = {.queue_ticks = 256}) : Streams(options) {}

  struct Frame {
    std::uint32_t first = 0;
    std::vector<LineMotor> motors;
    std::uint32_t longest;
    std::uint32_t from = 0;
    std::uint32_t steps = 0;  // 0: all
    std::uint16_t shortest_delay = 0;
    std::uint8_t bank = 0;
    std::uint8_t epoch = 0;
    bool elementary = false;
  };
  static Bytes frame(const Frame& of) {
    std::vector<bushd_line_entry> entries;
    for (const LineMotor& motor : of.motors) {
      entries.push_back(
          {motor.number, static_cast<std::int8_t>(motor.steps < 0 ? -1 : 1), length(motor.steps)});
    }
    bushd_line_run message{};
    message.epoch = of.epoch;
    message.first_tick = of.first;
    message.line = {.bank = of.bank,
                    .elementary = of.elementary,
                    .shortest_delay = of.shortest_delay,
                    .longest = of.longest,
                    .from = of.from,
                    .steps = of.steps == 0 ? of.longest - of.from : of.steps,
                    .count = 0,
                    .entries = nullptr};
    return payload_of([&](std::uint8_t* to) {
      return bushd_encode_line_run(&message, entries.data(),
                                   static_cast<std::uint8_t>(entries.size()), to);
    });
  }
  static bushd_status start(Rig& on, const Frame& of) {
    return on.take(BUSHD_MSG_LINE_RUN, frame(of));
  }

  // Ticks from this one of a line's run on take the place of its rest, and no step is lost or made
  // twice.
  struct Rest {
    std::size_t from;
    std::size_t ticks;  // of the run
    const std::vector<LineMotor>& motors;
  };
  template <class PositionAt>
  void replace_rest(Rig& fresh, std::uint32_t first, const Rest& of, PositionAt&& position_at) {
    const std::size_t k = of.from;
    const std::vector<LineMotor>& motors = of.motors;
    for (std::size_t from = k; from < of.ticks; from += 20) {
      const std::size_t count = std::min<std::size_t>(20, of.ticks - from);
      Ticks rest{.flags = from == k ? kReplace : std::uint8_t{0},
                 .first = first + static_cast<std::uint32_t>(from),
                 .count = static_cast<std::uint8_t>(count),
                 .mask = 7,
                 .displacements = {},
                 .delays = {},
                 .epoch = 1};
      for (std::size_t tick = from; tick < from + count; ++tick) {
        for (const LineMotor& motor : motors) {
          const std::int64_t moved = position_at(motor, tick + 1) - position_at(motor, tick);
          const bool back = motor.steps < 0;
          rest.displacements.push_back(static_cast<std::int16_t>(
              format == BUSHD_FORMAT_FINE ? (back ? -moved : moved)
                                          : (moved / 256) | (back ? 0 : BUSHD_COARSE_DIRECTION)));
        }
      }
      const bool over = from + count == of.ticks;
      for (std::size_t i = 0; i < motors.size(); ++i) {
        rest.delays.push_back(static_cast<std::uint16_t>(over ? 0 : 1000));
      }
      ASSERT_EQ(fresh.take(rest), BUSHD_OK) << k << " " << from;
      while (static_cast<std::int32_t>(rest.first - fresh.tick()) > 50) fresh.pass();
    }
    fresh.pass_until_rest();
    for (const LineMotor& motor : motors) {
      ASSERT_EQ(fresh.pulses(motor.number), motor.steps) << k;
      ASSERT_EQ(fresh.mcu().motor[motor.number].remainder, 0) << k;
    }
    ASSERT_EQ(fresh.poll().faults, 0);
    ASSERT_EQ(fresh.mcu().line.motors, 0);
  }

  // From tick `first` on, each slot of each tick until the run is over, which begins `late_ns`
  // after the beginning of that tick.
  static void expect_slots(Rig& of, const Reference& run, const Frame& frame,
                           std::uint32_t late_ns = 0) {
    const std::uint16_t slots = of.options().slots;
    std::vector<std::vector<Wide>> times;
    if (frame.elementary) times = elementary_times_of(run, frame.motors);
    for (const LineMotor& motor : frame.motors) {
      if (frame.elementary) break;
      times.push_back(times_of(run, length(motor.steps), frame.longest, frame.from));
    }
    std::vector<std::size_t> made(frame.motors.size());
    while (of.tick() != frame.first) of.pass();
    for (std::uint64_t tick = 0; of.poll().moving != 0; ++tick, of.pass()) {
      std::vector<std::uint16_t> expected(slots);
      const Wide begin = (Wide{tick * Rig::kTickNs} - late_ns) * 256;
      const Wide length = Wide{Rig::kTickNs} * 256;
      for (std::size_t i = 0; i < times.size(); ++i) {
        for (; made[i] < times[i].size() && times[i][made[i]] <= begin + length; ++made[i]) {
          const auto slot = static_cast<std::size_t>((times[i][made[i]] - begin) * slots / length);
          expected[std::min<std::size_t>(slot, slots - 1u)] |=
              static_cast<std::uint16_t>(1u << frame.motors[i].number);
        }
      }
      ASSERT_TRUE(std::ranges::equal(std::span(of.slot_buffer().step).first(slots), expected))
          << tick;
    }
    for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(made[i], times[i].size());
    EXPECT_EQ(of.poll().faults, 0);
  }
};

}  // namespace bushd::test
