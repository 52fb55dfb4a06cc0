// The part of the witness that is about programs of MCUs: which one runs under a name, where its
// motors must stand in the end, and that nobody else moves them meanwhile.
#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "witness.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;

std::vector<std::string> motors_of(const std::vector<api::MotorResult>& results) {
  std::vector<std::string> motors;
  for (const api::MotorResult& result : results) motors.push_back(result.motor);
  return motors;
}

}  // namespace

void Witness::mcu_reset(std::size_t mcu) {
  positions_.mcu_reset(mcu);
  for (Motor& motor : motors_) motor.program_may_go_on &= motor.mcu != mcu;
}

bool Witness::program_may_go_on() const {
  return std::ranges::any_of(motors_, [](const Motor& motor) { return motor.program_may_go_on; });
}

// It may be in a program that goes on whatever becomes of the daemon.
bool Witness::goes_on_alone(const Motor& motor) const {
  return config_.mcus[motor.mcu].programs_without_host &&
         (motor.program || motor.program_may_go_on);
}

// The daemon's: what it had asked of MCUs may be under way.
void Witness::forget_programs() {
  for (Motor& motor : motors_) {
    motor.program_may_go_on |= motor.program.has_value();
    motor.program.reset();
  }
}

void Witness::put_accepted(const Request& request) {
  if (!request.program.dry_run) programs_put_[request.program.name].push_back(request.program);
}

void Witness::put_finished(const Request& request, const api::Completed& completed) {
  const bool done = completed.outcome == api::Outcome::kDone;
  if (done && !request.program.dry_run) programs_put_[request.program.name] = {request.program};
}

// One of several that began together may have ended: that is told with the end of the last one.
void Witness::leave_program(TimeNs now_ns, Motor& motor, const Request& request) {
  motor.program_may_go_on = false;
  if (!motor.program) return;
  const Asked& asked = asked_.at(*motor.program);
  if (asked.request.programs.size() == 1 && second_ns_ < asked.since_ns) {
    violated(now_ns, motor.name + " is in a program, which has not ended: " + text_of(request));
  }
  motor.program.reset();
}

void Witness::programs_accepted(TimeNs now_ns, const Key& key, Asked& asked) {
  const Request& request = asked.request;
  std::size_t i = 0;
  for (const std::string& name : request.programs) {
    const std::vector<McuProgram>& texts = programs_put_[name];
    asked.programs.push_back(texts);
    if (texts.empty()) return violated(now_ns, "nobody has put it: " + text_of(request));
    const bool line = std::ranges::any_of(texts, &McuProgram::is_like_line);
    for (const std::string& motor_name : texts.front().motors) {
      Motor& motor = *find(motor_name);
      if (motor.held) {
        violated(now_ns, motor.name + " is held, and its program runs: " + text_of(request));
      }
      leave_program(now_ns, motor, request);
      forget_unbegun(motor);
      if (motor.moves() && second_ns_ < asked_.at(*motor.move).since_ns) {
        violated(now_ns, motor.name + " moves, and its program runs: " + text_of(request));
      }
      motor.is_asked_for(now_ns);
      motor.move.reset();
      motor.over = motor.goes_on = motor.stops = motor.pauses = false;
      motor.program = key;
      motor.range.reset();
      keep_within(now_ns, motor);
      asked.from.push_back(plant_steps(motor));
      if (on_run) on_run(now_ns, motor.mcu, motor.output, {.on_line = line, .waited = false});
      ++i;
    }
  }
  if (i != request.motors.size()) violated(now_ns, "other motors: " + text_of(request));
}

// Each program is judged by itself, unless something else has been asked of its motors since it
// ended.
void Witness::programs_ended(TimeNs now_ns, const Key& key, const Asked& asked,
                             const api::Completed& completed) {
  ++programs_by_result_[std::string(word(completed.outcome))];
  const auto* motors = std::get_if<Motors>(&completed.detail);
  if (motors == nullptr || motors_of(*motors) != asked.request.motors) {
    return violated(now_ns, "a result of other motors: " + text_of(asked.request));
  }
  std::size_t first = 0;
  for (const std::vector<McuProgram>& texts : asked.programs) {
    const std::size_t width = texts.front().motors.size();
    const bool its = std::ranges::all_of(texts.front().motors, [&](const std::string& motor) {
      return find(motor)->program == key;
    });
    if (its) program_ended(now_ns, asked, completed, first, texts);
    first += width;
  }
}

// Where one ends whose MCU was lost, or which goes on after the daemon's end, nobody knows yet.
void Witness::program_ended(TimeNs now_ns, const Asked& asked, const api::Completed& completed,
                            std::size_t first, const std::vector<McuProgram>& texts) {
  const auto& results = std::get<Motors>(completed.detail);
  const bool alone = second_ns_ < asked.since_ns;
  const McuProgram& program = texts.front();
  std::vector<std::int64_t> from;
  std::vector<std::int64_t> zero;
  bool known = alone && texts.size() == 1;
  for (std::size_t i = first; i < first + program.motors.size(); ++i) {
    const api::MotorResult& result = results[i];
    Motor& motor = *find(result.motor);
    const bool lost = result.outcome == api::Outcome::kLink;
    const bool good = offset(motor) && trusted(motor);
    const std::int64_t stands = plant_steps(motor);
    if (!lost && alone && good && stands - *offset(motor) != result.position_steps) {
      violated(now_ns,
               fmt::format("{} {} at {}, but stands at {}", motor.name, word(result.outcome),
                           result.position_steps, stands - *offset(motor)));
    }
    if (completed.reason.starts_with(motor.name + ": stopped on request") && !motor.stops &&
        alone) {
      violated(now_ns, "nobody has stopped it: " + completed.reason);
    }
    motor.program_may_go_on = lost;
    motor.program.reset();
    const std::string end(word(result.outcome));
    if (on_run_end) on_run_end(now_ns, motor.mcu, motor.output, end);
    known = known && result.outcome == api::Outcome::kReached && (good || !program.has_positions());
    zero.push_back(offset(motor).value_or(0));
    from.push_back(*asked.from[i]);
  }
  if (!known) return;
  ++programs_judged_;
  const std::vector<std::int64_t> end = program.end(std::move(from), zero);
  if (end.empty()) violated(now_ns, "it has no end, and came to it: " + text_of(asked.request));
  for (std::size_t i = 0; i < end.size(); ++i) {
    const std::int64_t stands = plant_steps(*find(program.motors[i]));
    if (stands == end[i]) continue;
    violated(now_ns, fmt::format("{} is at the end of its program, {} steps off where that leads",
                                 program.motors[i], stands - end[i]));
  }
}

}  // namespace bushfaults
