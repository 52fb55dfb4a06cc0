#include "sim/plant.h"

#include <algorithm>

namespace bushd::sim {
namespace {

std::string in_us(TimeNs ns) {
  return std::to_string(ns / 1000) + " us";
}

}  // namespace

Plant::Plant(std::size_t mcus) : motor_of_(mcus), enabled_(mcus, false) {
  for (auto& motors : motor_of_) motors.resize(kOutputsPerMcu);
}

void Plant::Motor::count(TimeNs time_ns) {
  const int direction = forward ? 1 : -1;
  position_steps += direction;
  latest[steps_made++ % kLatest] = {time_ns, direction};
}

std::int64_t Plant::position_steps_before(std::size_t mcu, std::size_t output, TimeNs t_ns) const {
  const Motor& motor = *motor_of_[mcu].at(output);
  std::int64_t position_steps = motor.position_steps;
  const std::size_t oldest = motor.steps_made - std::min(motor.steps_made, kLatest);
  for (std::size_t i = motor.steps_made; i-- > oldest;) {
    const Step& step = motor.latest[i % kLatest];
    if (step.time_ns < t_ns) break;
    position_steps -= step.direction;
  }
  return position_steps;
}

void Plant::attach(std::size_t mcu, std::size_t output, const PaceRules& rules) {
  motor_of_[mcu].at(output) = std::make_unique<Motor>(rules);
}

void Plant::couple(std::size_t mcu, std::size_t output, const RotorRules& rules) {
  motor_of_[mcu].at(output)->rotor.emplace(rules);
}

void Plant::violated(TimeNs time_ns, std::size_t mcu, std::size_t output, const std::string& what) {
  if (on_violation) on_violation(time_ns, mcu, output, what);
}

void Plant::report(TimeNs time_ns, std::size_t mcu, std::size_t output, const Motor& motor,
                   Jump jump) {
  switch (jump) {
    case Jump::kNone:
      break;
    case Jump::kTooFast:
      violated(time_ns, mcu, output,
               "jump in speed: a step " + in_us(motor.pace.too_early_ns()) +
                   " earlier than its table allows");
      break;
    case Jump::kTurned:
      violated(time_ns, mcu, output,
               "turned without a rest, " + in_us(motor.pace.too_early_ns()) + " too early");
      break;
    case Jump::kStoppedDead:
      violated(time_ns, mcu, output, "stopped without the ramp-down of its table");
      break;
  }
}

void Plant::edge(const Edge& edge) {
  if (edge.signal >= Signal::kPositionCompare) return;  // nothing of motors
  if (edge.signal == Signal::kEnable) {
    enabled_[edge.mcu] = edge.level;
    return;
  }
  if (edge.signal == Signal::kCommonDir) {
    for (const auto& each : motor_of_[edge.mcu]) {
      if (each) each->forward = edge.level;
    }
    return;
  }
  Motor* motor = motor_of_[edge.mcu][edge.index].get();
  if (motor == nullptr) {
    if (edge.signal == Signal::kStep && edge.level) {
      violated(edge.time_ns, edge.mcu, edge.index, "a step where no motor is");
    }
    return;
  }
  if (edge.signal == Signal::kDir) {
    motor->forward = edge.level;
    return;
  }
  if (!edge.level) return;  // a driver steps when STEP rises
  // An emergency may switch the driver off in the middle of a tick, and what is prepared is
  // emitted.
  const bool prepared =
      motor->halt && motor->halt->immediate && edge.time_ns <= motor->halt->from_ns;
  if (!enabled_[edge.mcu] && !prepared) {
    violated(edge.time_ns, edge.mcu, edge.index, "a step while its driver is off");
    return;
  }
  ++steps_made_;
  motor->count(edge.time_ns);
  if (on_step) on_step(edge.time_ns, edge.mcu, edge.index, motor->forward);
  if (motor->rotor) motor->rotor->step(edge.time_ns, motor->forward);
  if (motor->halt && edge.time_ns > motor->halt->from_ns) {
    check_halt(edge.time_ns, edge.mcu, edge.index, *motor);
  }
  const Jump jump = motor->pace.step(edge.time_ns, motor->forward);
  if (jump != Jump::kNone) report(edge.time_ns, edge.mcu, edge.index, *motor, jump);
}

void Plant::settled(TimeNs until_ns) {
  for (std::size_t mcu = 0; mcu < motor_of_.size(); ++mcu) {
    for (std::size_t output = 0; output < kOutputsPerMcu; ++output) {
      Motor* motor = motor_of_[mcu][output].get();
      if (motor == nullptr) continue;
      check_rotor(until_ns, mcu, output, *motor);
      if (!motor->pace.moving()) continue;
      if (motor->halt && motor->halt->immediate && until_ns >= motor->halt->from_ns) {
        if (motor->pace.cut_off() && on_cut_off) on_cut_off(until_ns, mcu, output);
      }
      const Jump jump = motor->pace.silent(until_ns);
      if (jump != Jump::kNone) report(until_ns, mcu, output, *motor, jump);
    }
  }
}

void Plant::rest_on_line(TimeNs now_ns, std::size_t mcu, std::size_t output, bool rests) {
  Motor& motor = *motor_of_[mcu].at(output);
  const Jump jump = motor.pace.rest_on_line(now_ns, rests);
  // Told before the two ticks of an immediate stop are over, in which it makes no step.
  if (jump == Jump::kStoppedDead && motor.halt && motor.halt->immediate) {
    if (on_cut_off) on_cut_off(now_ns, mcu, output);
    return;
  }
  report(now_ns, mcu, output, motor, jump);
}

void Plant::cut(std::size_t mcu) {
  for (const auto& motor : motor_of_[mcu]) {
    if (motor) motor->pace.cut();
  }
  release(mcu);
}

void Plant::halt(std::size_t mcu, TimeNs now_ns, bool immediate) {
  for (const auto& motor : motor_of_[mcu]) {
    if (!motor || (motor->halt && motor->halt->immediate >= immediate)) continue;
    const TimeNs tick_ns = motor->rules->tick_ns();
    motor->halt = Halt{now_ns + 2 * tick_ns + tick_ns / 16, immediate, motor->pace.ramp_down_ns()};
  }
}

void Plant::release(std::size_t mcu) {
  for (const auto& motor : motor_of_[mcu]) {
    if (motor) motor->halt.reset();
  }
}

void Plant::check_rotor(TimeNs until_ns, std::size_t mcu, std::size_t output, Motor& motor) {
  if (!motor.rotor) return;
  motor.rotor->advance_to(until_ns);
  if (motor.slipped || !motor.rotor->slipped_ns()) return;
  motor.slipped = true;
  violated(*motor.rotor->slipped_ns(), mcu, output, "the rotor does not follow and loses steps");
}

void Plant::check_halt(TimeNs time_ns, std::size_t mcu, std::size_t output, Motor& motor) {
  Halt& halt = *motor.halt;
  if (halt.immediate) return violated(time_ns, mcu, output, "a step after an immediate stop");
  if (!halt.seen) halt.ramp_down_ns = std::max(halt.ramp_down_ns, motor.pace.ramp_down_ns());
  halt.seen = true;
  const TimeNs late_ns = time_ns - halt.from_ns - halt.ramp_down_ns;
  if (late_ns <= 0) return;
  violated(time_ns, mcu, output,
           "still moving " + in_us(late_ns) + " after an emergency stop's ramp");
}

}  // namespace bushd::sim
