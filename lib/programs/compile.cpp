#include "programs/compile.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/overloaded.h"
#include "engine/message_motion.h"
#include "engine/program.h"

namespace bushd::programs {
namespace {

class Writer {
 public:
  void put(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

class Compiler {
 public:
  Compiler(const Program& program, const McuPlace& mcu, std::span<const MotorPlace> motors)
      : program_(program), mcu_(mcu), motors_(motors), by_output_(motors.size()) {
    std::iota(by_output_.begin(), by_output_.end(), std::size_t{0});
    std::ranges::sort(by_output_, {}, [&](std::size_t i) { return motors_[i].output; });
  }

  Result<std::vector<std::uint8_t>> compile() {
    if (auto put = put_head(); !put) return fail(put.error());
    for (const Frame& frame : program_.frames) {
      const auto put =
          std::visit(Overloaded{[&](const Move& move) { return put_move(move); },
                                [&](const Line& line) { return put_line(line); },
                                [&](const Travel& travel) { return put_travel(travel); },
                                [&](const auto& other) {
                                  put_other(other);
                                  return Result<void>();
                                }},
                     frame.what);
      if (!put) return fail(frame.place + ": " + put.error().text());
    }
    out_.put(BUSHD_PROGRAM_END, 1);
    std::vector<std::uint8_t> bytes = out_.take();
    if (bytes.size() <= mcu_.memory) return bytes;
    return fail("the program has " + std::to_string(bytes.size()) + " bytes, but " + mcu_.name +
                " has memory for " + std::to_string(mcu_.memory) +
                ": use fewer points or frames, or repeat them");
  }

 private:
  unsigned flags() const {
    unsigned flags = 0;
    if (program_.without_host) flags |= BUSHD_PROGRAM_WITHOUT_HOST;
    if (program_.kept) flags |= BUSHD_PROGRAM_KEPT;
    if (program_.at_power_on) flags |= BUSHD_PROGRAM_AT_POWER_ON;
    return flags;
  }

  // Steps, the least one first: positions, or distances with at_power_on.
  Result<std::pair<std::int64_t, std::int64_t>> range_of(std::size_t i) const {
    const MotorPlace& motor = motors_[i];
    if (!program_.at_power_on) return std::pair{motor.least_steps, motor.most_steps};
    const auto least = steps_of(i, program_.range[i].least, true);
    if (!least) return fail(least.error());
    const auto most = steps_of(i, program_.range[i].most, true);
    if (!most) return fail(most.error());
    const std::pair<std::int64_t, std::int64_t> range = std::minmax(*least, *most);
    if (range.second - range.first <= motor.most_steps - motor.least_steps) return range;
    return fail("motor \"" + motor.name +
                "\": its range is wider than the way between its soft limits");
  }

  Result<void> put_head() {
    out_.put(BUSHD_PROGRAM_FORMAT, 1);
    out_.put(flags(), 1);
    unsigned mask = 0;
    for (const MotorPlace& motor : motors_) mask |= 1u << motor.output;
    out_.put(mask, 2);
    for (const std::size_t i : by_output_) {
      const auto range = range_of(i);
      if (!range) return fail(range.error());
      out_.put(motors_[i].bank, 1);
      out_.put(static_cast<std::uint32_t>(range->first), 4);
      out_.put(static_cast<std::uint32_t>(range->second), 4);
    }
    return {};
  }

  Result<std::int32_t> steps_of(std::size_t i, double value, bool relative) const {
    return steps_of(i, value, relative, program_.steps);
  }
  Result<std::int32_t> steps_of(std::size_t i, double value, bool relative, bool in_steps) const {
    const MotorPlace& motor = motors_[i];
    const units::Coordinates plain;
    const units::Coordinates& scale = in_steps ? plain : motor.coordinates;
    const auto steps = relative ? scale.steps_of_distance(value) : scale.steps_of_user(value);
    if (!steps) return fail("motor \"" + motor.name + "\": " + steps.error().message);
    if (in_steps && static_cast<double>(*steps) != value) {
      return fail("motor \"" + motor.name + "\": not a whole number of steps; allowed: whole ones");
    }
    return static_cast<std::int32_t>(*steps);
  }

  // So many time units that no step comes sooner than the motor's limit and this speed allow.
  Result<std::uint16_t> delay_of(std::size_t i, std::optional<double> speed,
                                 std::uint32_t unit_ns) const {
    const MotorPlace& motor = motors_[i];
    std::uint64_t delay = (motor.shortest_delay_ns + unit_ns - 1) / unit_ns;
    if (speed) {
      const units::Coordinates plain;
      const auto of_speed = (program_.steps ? plain : motor.coordinates).delay_at(*speed, unit_ns);
      if (!of_speed) return fail("motor \"" + motor.name + "\": " + of_speed.error().message);
      delay = std::max(delay, *of_speed);
    }
    if (delay <= UINT16_MAX) return static_cast<std::uint16_t>(delay);
    return fail("motor \"" + motor.name + "\": a step of " + std::to_string(delay) +
                " time units of its table, but a program has delays up to 65535: use a higher "
                "speed, or a table with a longer time unit");
  }

  // Codes that no table could have.
  bool as_written() const { return program_.codes && bushd_table_is_written(mcu_.line_table); }

  unsigned mask_of(const Point& point) const {
    unsigned mask = 0;
    for (std::size_t i = 0; i < point.size(); ++i) {
      if (point[i]) mask |= 1u << motors_[i].output;
    }
    return mask;
  }

  Result<void> put_until(const Move& move) {
    std::size_t i = 0;
    while (!move.to[i]) ++i;
    const auto after = steps_of(i, move.until->after, true);
    if (!after) return fail("after: " + after.error().text());
    const std::int64_t steps = *after;
    out_.put(move.until->input, 1);
    out_.put(move.until->active ? 1 : 0, 1);
    out_.put(static_cast<std::uint64_t>(std::abs(steps)), 4);
    return {};
  }

  Result<void> put_move(const Move& move) {
    const auto kind = move.until      ? BUSHD_PROGRAM_MOVE_UNTIL
                      : move.relative ? BUSHD_PROGRAM_MOVE_BY
                                      : BUSHD_PROGRAM_MOVE_TO;
    out_.put(kind, 1);
    out_.put(mask_of(move.to), 2);
    if (move.until) {
      if (auto put = put_until(move); !put) return put;
    }
    for (const std::size_t i : by_output_) {
      if (!move.to[i]) continue;
      const auto steps = steps_of(i, *move.to[i], move.relative);
      if (!steps) return fail(steps.error());
      const auto delay = delay_of(i, move.speed, motors_[i].table->time_unit_ns);
      if (!delay) return fail(delay.error());
      out_.put(static_cast<std::uint32_t>(*steps), 4);
      out_.put(*delay, 2);
    }
    return {};
  }

  // The feed is that of elementary steps, which all have the same length.
  Result<std::uint16_t> delay_of_feed(const Line& line) const {
    const MotorPlace* first = nullptr;
    for (const std::size_t i : by_output_) {
      if (!line.points.front()[i]) continue;
      const MotorPlace& motor = motors_[i];
      if (first == nullptr) first = &motor;
      const units::Scale& scale = motor.coordinates.scale();
      const units::Scale& of_first = first->coordinates.scale();
      if (program_.steps ||
          (scale.unit == of_first.unit && scale.steps_per_unit == of_first.steps_per_unit)) {
        continue;
      }
      return fail("a feed is that of steps which are " + to_text(of_first.steps_per_unit) +
                  " per " + of_first.unit + " for motor \"" + first->name + "\" and " +
                  to_text(scale.steps_per_unit) + " per " + scale.unit + " for motor \"" +
                  motor.name + "\": use speed, or unit = \"steps\"");
    }
    const units::Coordinates plain;
    const auto delay = (program_.steps ? plain : first->coordinates)
                           .delay_at(*line.feed, mcu_.line_table->time_unit_ns);
    if (!delay) return fail("feed: " + delay.error().message);
    if (*delay <= UINT16_MAX) return static_cast<std::uint16_t>(*delay);
    return fail(
        "a step at this feed has " + std::to_string(*delay) +
        " time units of the lines' table, but a program has delays up to 65535: use a higher "
        "feed");
  }

  Result<void> put_line(const Line& line) {
    if (!mcu_.lines) {
      return fail(mcu_.name + " makes no lines by itself: use moves, or another MCU");
    }
    if (mcu_.line_table == nullptr) {
      return fail(mcu_.name + " has no table bank left for lines: let more motors share a table");
    }
    if (line.elementary && !mcu_.elementary) {
      return fail(mcu_.name +
                  " makes no lines by the elementary law: leave out `law`, or use another MCU");
    }
    if (program_.codes && line.speed) {
      return fail("there is no `speed` beside `codes`: write longer delays");
    }
    if (program_.codes && line.elementary) {
      return fail("there is no `law` beside `codes`, which have one motor: leave it out");
    }
    if (program_.at_power_on && mcu_.line_bank == BUSHD_SCRATCH_BANK) {
      return fail(mcu_.name +
                  " would have the table of lines in its volatile bank, and no more after a power "
                  "cut: use moves, or let more motors share a table");
    }
    std::uint16_t shortest_delay = 0;
    for (const std::size_t i : by_output_) {
      if (as_written() || !line.points.front()[i]) continue;
      const auto delay = delay_of(i, line.speed, mcu_.line_table->time_unit_ns);
      if (!delay) return fail(delay.error());
      shortest_delay = std::max(shortest_delay, *delay);
    }
    if (line.feed) {
      const auto delay = delay_of_feed(line);
      if (!delay) return fail(delay.error());
      shortest_delay = std::max(shortest_delay, *delay);
    }
    out_.put(line.relative ? BUSHD_PROGRAM_LINE_BY : BUSHD_PROGRAM_LINE_TO, 1);
    out_.put(mask_of(line.points.front()), 2);
    out_.put(mcu_.line_bank | (line.elementary ? 0x80u : 0u), 1);
    out_.put(shortest_delay, 2);
    out_.put(line.points.size(), 2);
    const bool in_steps = line.envelope ? !line.envelope->steps_per_unit : program_.steps;
    for (const Point& point : line.points) {
      for (const std::size_t i : by_output_) {
        if (!point[i]) continue;
        const auto steps = steps_of(i, *point[i], line.relative, in_steps);
        if (!steps) return fail(steps.error());
        out_.put(static_cast<std::uint32_t>(*steps), 4);
      }
    }
    return {};
  }

  Result<void> put_travel(const Travel& travel) {
    if (!mcu_.travels) {
      return fail(mcu_.name + " does not travel between limits by itself: use moves");
    }
    if (travel.at_edges && !mcu_.has_trigger) {
      return fail(mcu_.name + " has no trigger input: leave `after_edge_s` out");
    }
    if (program_.codes && mcu_.line_table == nullptr) {
      return fail(mcu_.name + " has no table bank left for `codes`");
    }
    std::size_t i = 0;
    while (!travel.by[i]) ++i;
    const auto steps = steps_of(i, *travel.by[i], true);
    if (!steps) return fail(steps.error());
    if (*steps == 0) return fail("motor \"" + motors_[i].name + "\" travels by no step");
    out_.put(BUSHD_PROGRAM_TRAVEL, 1);
    out_.put(mask_of(travel.by), 2);
    out_.put(program_.codes ? mcu_.line_bank : motors_[i].bank, 1);
    out_.put(travel.at_edges ? BUSHD_EDGE_RISING : BUSHD_EDGE_NONE, 1);
    out_.put(travel.delay_us, 4);
    out_.put(travel.return_us, 4);
    out_.put(static_cast<std::uint32_t>(*steps), 4);
    return {};
  }

  void put_other(const Wait& wait) {
    out_.put(BUSHD_PROGRAM_WAIT, 1);
    out_.put(wait.us, 4);
  }
  void put_other(const WaitInput& wait) {
    out_.put(BUSHD_PROGRAM_WAIT_INPUT, 1);
    out_.put(wait.input, 1);
    out_.put(wait.active ? 1 : 0, 1);
    out_.put(wait.longest_us, 4);
  }
  void put_other(const Pulse& pulse) {
    out_.put(BUSHD_PROGRAM_PULSE, 1);
    out_.put(pulse.us, 4);
  }
  void put_other(const Repeat& repeat) {
    out_.put(BUSHD_PROGRAM_REPEAT, 1);
    out_.put(repeat.count, 2);
  }
  void put_other(const Next&) { out_.put(BUSHD_PROGRAM_NEXT, 1); }

  const Program& program_;
  const McuPlace& mcu_;
  std::span<const MotorPlace> motors_;
  std::vector<std::size_t> by_output_;
  Writer out_;
};

}  // namespace

Result<std::vector<std::uint8_t>> compile(const Program& program, const McuPlace& mcu,
                                          std::span<const MotorPlace> motors) {
  return Compiler(program, mcu, motors).compile();
}

}  // namespace bushd::programs
