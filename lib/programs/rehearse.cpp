#include <algorithm>
#include <array>
#include <cstdlib>

#include "engine/message_motion.h"
#include "engine/program.h"
#include "engine/run.h"
#include "programs/compile.h"

namespace bushd::programs {
namespace {

constexpr std::uint32_t kBeginsInATick = 8;  // docs/protocol.md, Programs

class Walk {
 public:
  Walk(const Program& text, const McuPlace& mcu, std::span<const MotorPlace> motors,
       const bushd_program& program, std::size_t most_frames)
      : text_(text),
        mcu_(mcu),
        motors_(motors),
        program_(program),
        most_frames_(most_frames),
        at_(program.frames) {
    for (const MotorPlace& motor : motors_) {
      out_.motors.push_back({motor.at_steps, motor.at_steps, motor.at_steps, 0});
      behind_.push_back(0);
    }
    for (std::size_t i = 0; i < motors_.size(); ++i) of_output_[motors_[i].output] = i;
  }

  Result<Rehearsal> walk() {
    for (std::size_t carried_out = 0; !ended_;) {
      begin();
      const bushd_program_frame frame = bushd_next_program_frame(&program_, &at_);
      ++frame_;
      carried_out += std::max<std::size_t>(frame.points, 1);
      if (carried_out > most_frames_) {
        out_.cut = true;
        return out_;
      }
      auto made = carry_out(frame);
      if (!made) return fail(made.error());
    }
    return out_;
  }

 private:
  struct Pass {
    const std::uint8_t* at;
    std::size_t frame;
    std::uint16_t left;  // 0: without end
  };

  void later(std::uint64_t ticks) {
    out_.ticks += ticks;
    if (ticks != 0) begun_ = 0;
  }
  void begin() {
    if (begun_ == kBeginsInATick) later(1);
    ++begun_;
  }

  std::uint64_t ticks_of(std::uint64_t ns) const { return (ns + mcu_.tick_ns - 1) / mcu_.tick_ns; }
  std::uint64_t ticks_of(const bushd_table& table, std::uint64_t steps,
                         std::uint16_t shortest_delay) const {
    bushd_run run;
    bushd_run_start(&run, &table, static_cast<std::uint32_t>(steps), 1, shortest_delay);
    return ticks_of(bushd_run_units_left(&run) * table.time_unit_ns);
  }

  Result<void> carry_out(const bushd_program_frame& frame) {
    switch (frame.kind) {
      case BUSHD_PROGRAM_END:
        ended_ = true;
        break;
      case BUSHD_PROGRAM_MOVE_TO:
      case BUSHD_PROGRAM_MOVE_BY:
      case BUSHD_PROGRAM_MOVE_UNTIL:
        return move(frame);
      case BUSHD_PROGRAM_LINE_TO:
      case BUSHD_PROGRAM_LINE_BY:
        return line(frame);
      case BUSHD_PROGRAM_TRAVEL:
        return travel(frame);
      case BUSHD_PROGRAM_WAIT:
        later(ticks_of(std::uint64_t{frame.us} * 1000));
        break;
      case BUSHD_PROGRAM_WAIT_INPUT:
        out_.waits_for_inputs = true;
        break;
      case BUSHD_PROGRAM_PULSE:
        ++out_.pulses;
        break;
      case BUSHD_PROGRAM_REPEAT:
        passes_.push_back({at_, frame_, frame.count});
        break;
      default:
        end_pass();
    }
    return {};
  }

  // One without end is gone through once.
  void end_pass() {
    Pass& pass = passes_.back();
    if (pass.left == 0) {
      out_.endless = true;
      ended_ = true;
    } else if (pass.left == 1) {
      passes_.pop_back();
    } else {
      --pass.left;
      at_ = pass.at;
      frame_ = pass.frame;
    }
  }

  // What the MCU holds one to that begins at power-on: distances from where it is then.
  Result<void> within_its_range(std::size_t i, std::int64_t target) const {
    if (!text_.at_power_on) return {};
    const MotorPlace& motor = motors_[i];
    std::uint8_t nth = 0;
    for (const MotorPlace& other : motors_) {
      if (other.output < motor.output) ++nth;
    }
    const bushd_program_motor part = bushd_program_part(&program_, nth);
    const std::int64_t distance = target - motor.at_steps;
    if (distance >= part.least_steps && distance <= part.most_steps) return {};
    return fail(text_.frames[frame_ - 1].place + ": motor \"" + motor.name + "\" would come " +
                std::to_string(distance) + " steps from where it begins, but its range is " +
                std::to_string(part.least_steps) + " to " + std::to_string(part.most_steps) +
                " steps");
  }

  Result<void> within_limits(const bushd_program_frame& frame, std::uint16_t point, std::size_t i,
                             std::int64_t target) const {
    const MotorPlace& motor = motors_[i];
    if (target < motor.least_steps || target > motor.most_steps) {
      const std::string of_point =
          frame.points > 1 ? ", point " + std::to_string(point + 1) : std::string();
      return fail(text_.frames[frame_ - 1].place + of_point + ": motor \"" + motor.name +
                  "\" would go to " + motor.coordinates.text(target) + ", but may go from " +
                  motor.coordinates.text(motor.least_steps) + " to " +
                  motor.coordinates.text(motor.most_steps));
    }
    return within_its_range(i, target);
  }

  // Where an input has ended a move nobody knows where the motor is: between `end_steps` and so
  // much behind it, until a frame names its position. Both ends are looked at.
  Result<std::int64_t> go(const bushd_program_frame& frame, std::uint16_t point, std::uint8_t nth,
                          std::size_t i) {
    Rehearsal::Way& way = out_.motors[i];
    const std::int64_t steps = bushd_program_entry_of(&frame, point, nth).steps;
    const bool relative =
        bushd_program_is_relative(frame.kind) || frame.kind == BUSHD_PROGRAM_TRAVEL;
    const bool until = frame.kind == BUSHD_PROGRAM_MOVE_UNTIL;
    const auto [low, high] = std::minmax({way.end_steps, way.end_steps - behind_[i]});
    const std::int64_t from_low = relative ? low + steps : steps;
    const std::int64_t from_high = relative ? high + steps : steps;
    for (const std::int64_t end : {from_low, from_high}) {
      if (auto fits = within_limits(frame, point, i, end); !fits) return fail(fits.error());
      way.least_steps = std::min(way.least_steps, end);
      way.most_steps = std::max(way.most_steps, end);
    }
    const std::int64_t distance = std::max(std::abs(from_low - low), std::abs(from_high - high));
    if (distance > INT32_MAX) {
      return fail(text_.frames[frame_ - 1].place + ": motor \"" + motors_[i].name +
                  "\" would go more than 2^31 - 1 steps at once");
    }
    if (steps >= 0 || !relative) {
      way.end_steps = from_high;
      behind_[i] = from_high - (until ? low : from_low);
    } else {
      way.end_steps = from_low;
      behind_[i] = from_low - (until ? high : from_high);
    }
    out_.waits_for_inputs |= until;
    way.edges += static_cast<std::uint64_t>(distance);
    return distance;
  }

  // By the table of lines; or by codes as they are written, all of which are made.
  Result<std::uint64_t> ticks_by_line_table(std::uint64_t steps,
                                            std::uint16_t shortest_delay) const {
    const bushd_table& codes = *mcu_.line_table;
    if (!text_.codes || !bushd_table_is_written(&codes)) {
      return ticks_of(codes, steps, shortest_delay);
    }
    const std::uint64_t count = std::uint64_t{codes.accel.count} + codes.decel.count;
    if (steps < count) {
      return fail(text_.frames[frame_ - 1].place + ": " + std::to_string(steps) +
                  " steps, but `codes` has " + std::to_string(count) +
                  " delays; give as many steps, or more, which have its cruise delay");
    }
    bushd_run run;
    bushd_run_start_as_written(&run, &codes, static_cast<std::uint32_t>(steps), 1);
    return ticks_of(bushd_run_units_left(&run) * codes.time_unit_ns);
  }

  // There and back; from an edge on, once.
  Result<void> travel(const bushd_program_frame& frame) {
    std::size_t i = 0;
    while ((frame.motors >> motors_[i].output & 1u) == 0) ++i;
    const auto steps = go(frame, 0, 0, i);
    if (!steps) return fail(steps.error());
    out_.motors[i].end_steps -= bushd_program_entry_of(&frame, 0, 0).steps;
    out_.motors[i].edges += static_cast<std::uint64_t>(*steps);
    const auto way = static_cast<std::uint64_t>(*steps);
    std::uint64_t ticks = ticks_of(*motors_[i].table, way, 0);
    if (text_.codes) {
      const auto by_codes = ticks_by_line_table(way, 0);
      if (!by_codes) return fail(by_codes.error());
      ticks = *by_codes;
    }
    if (frame.edge == BUSHD_EDGE_NONE) {
      later(2 * ticks + ticks_of(std::uint64_t{frame.us} * 1000));
      return {};
    }
    later(ticks + ticks_of(std::uint64_t{frame.delay_us} * 1000) + ticks);
    out_.waits_for_inputs = true;
    out_.endless = true;
    ended_ = true;
    return {};
  }

  template <class Act>
  Result<void> for_motors(const bushd_program_frame& frame, std::uint16_t point, Act&& act) {
    std::uint8_t nth = 0;
    for (std::uint8_t output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
      if ((frame.motors >> output & 1u) == 0) continue;
      const auto distance = go(frame, point, nth, of_output_[output]);
      if (!distance) return fail(distance.error());
      act(static_cast<std::uint64_t>(*distance), nth, of_output_[output]);
      ++nth;
    }
    return {};
  }

  Result<void> move(const bushd_program_frame& frame) {
    std::uint64_t ticks = 0;
    auto gone = for_motors(frame, 0, [&](std::uint64_t steps, std::uint8_t nth, std::size_t i) {
      if (steps == 0) return;
      const std::uint16_t shortest = bushd_program_entry_of(&frame, 0, nth).shortest_delay;
      ticks = std::max(ticks, ticks_of(*motors_[i].table, steps, shortest));
    });
    if (gone) later(ticks);
    return gone;
  }

  Result<void> line(const bushd_program_frame& frame) {
    for (std::uint16_t point = 0; point < frame.points; ++point) {
      if (point != 0) begin();
      std::uint64_t longest = 0;
      auto gone = for_motors(frame, point, [&](std::uint64_t steps, std::uint8_t, std::size_t) {
        longest = frame.elementary ? longest + steps : std::max(longest, steps);
      });
      if (!gone) return gone;
      if (longest > INT32_MAX) {
        return fail(text_.frames[frame_ - 1].place + ", point " + std::to_string(point + 1) +
                    ": the ways of all motors together are more than 2^31 - 1 steps; make several "
                    "lines of it, or leave out `law`");
      }
      if (longest == 0) continue;
      const auto ticks = ticks_by_line_table(longest, frame.shortest_delay);
      if (!ticks) return fail(ticks.error());
      later(*ticks);
    }
    return {};
  }

  const Program& text_;
  const McuPlace& mcu_;
  std::span<const MotorPlace> motors_;
  const bushd_program& program_;
  const std::size_t most_frames_;
  const std::uint8_t* at_;
  std::array<std::size_t, BUSHD_MOTORS_PER_MCU> of_output_{};
  std::size_t frame_ = 0;    // frames begun, of the text
  std::uint32_t begun_ = 0;  // in this tick
  bool ended_ = false;
  std::vector<Pass> passes_;
  std::vector<std::int64_t> behind_;  // by motor
  Rehearsal out_;
};

}  // namespace

Result<Rehearsal> rehearse(const Program& text, const McuPlace& mcu,
                           std::span<const MotorPlace> motors, std::span<const std::uint8_t> bytes,
                           std::size_t most_frames) {
  bushd_program program;
  if (bushd_program_check(bytes.data(), bytes.size(), UINT16_MAX, &program) != BUSHD_OK) {
    return fail("this is no program; compile it anew");
  }
  auto rehearsal = Walk(text, mcu, motors, program, most_frames).walk();
  if (rehearsal) rehearsal->bytes = bytes.size();
  return rehearsal;
}

}  // namespace bushd::programs
