#include "daemon/services/moves.h"

#include <algorithm>
#include <map>
#include <utility>

#include "base/overloaded.h"

namespace bushd::daemon {
namespace {

link::McuRun run_begun(const Mcu& mcu, const motion::Axis& axis,
                       const motion::event::Started& started) {
  if (axis.line()) return mcu.line_run(axis);
  return link::TableRun{static_cast<std::int32_t>(started.steps), axis.shortest_delay()};
}

}  // namespace

void Moves::request(std::int64_t now_us, const api::Asker& asker, const api::Move& move) {
  while (begins()) begin_next();  // of a caller that does not let it wait
  const auto parts = parts_of(move);
  if (!parts) return asker.answer(api::Refused{parts.error().text()});
  if (!move.dry_run) return start(now_us, asker, *parts);
  std::vector<DryRun::Part> planned;
  for (const Part& part : *parts) {
    const motion::Motor& motor = installation_[part.motor];
    if (motor.has_plan()) {
      return asker.answer(api::Refused{motor.name() + " moves; a dry run is of moves from rest"});
    }
    std::int64_t from = motor.position_steps();
    for (const motion::Leg& leg : part.legs) {
      planned.push_back({part.motor, leg.target - from, leg.shortest_delay, from});
      from = leg.target;
    }
  }
  dry_runs_.request(now_us, asker, planned);
}

Result<std::vector<Moves::Part>> Moves::parts_of(const api::Move& move) const {
  const auto motors = installation_.find(move.motors);
  if (!motors) return fail(motors.error());
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  std::vector<Part> parts;
  for (std::size_t i = 0; i < motors->size(); ++i) {
    auto part = part_of((*motors)[i], move.motors[i].amount, move);
    if (!part) return fail(part.error());
    for (const Part& other : parts) {
      const Mcu& mcu = installation_.mcu_of(other.motor);
      if (!mcu.offers.one_at_a_time || mcu.id != installation_.mcu_of(part->motor).id) continue;
      return fail("the board " + mcu.name() + " moves one motor at a time; move " +
                  installation_[part->motor].name() + " after " +
                  installation_[other.motor].name());
    }
    parts.push_back(std::move(*part));
  }
  return parts;
}

Result<Moves::Part> Moves::part_of(MotorId motor, const api::Amount& amount,
                                   const api::Move& move) const {
  const auto shortest_delay = shortest_delay_of(motor, move.speed);
  if (!shortest_delay) return fail(shortest_delay.error());
  const auto target = target_of(motor, amount, move.kind, *shortest_delay);
  if (!target) return fail(target.error());
  auto legs = installation_[motor].reach().legs_to(target->whole, *shortest_delay);
  if (!legs) return fail(installation_[motor].name() + ": " + legs.error().message);
  return Part{.motor = motor, .target = *target, .legs = std::move(*legs)};
}

Result<bushd_delay> Moves::shortest_delay_of(MotorId id,
                                             const std::optional<api::Speed>& speed) const {
  const motion::Motor& motor = installation_[id];
  auto shortest_delay = motor.reach().shortest_delay_at(speed);
  if (!shortest_delay) return fail(motor.name() + ": " + shortest_delay.error().message);
  return shortest_delay;
}

Result<units::Steps> Moves::target_of(MotorId id, const api::Amount& amount, api::Move::Kind kind,
                                      bushd_delay shortest_delay) const {
  const motion::Motor& motor = installation_[id];
  const bool absolute = kind == api::Move::Kind::kAbsolute;
  const auto counted =
      absolute ? motor.scale().position_of(amount) : motor.scale().distance_of(amount);
  if (!counted) return fail(motor.name() + ": " + counted.error().message);
  const std::int64_t steps = counted->whole;
  // Compared before any arithmetic: the sum of two values from outside could overflow.
  if (steps > 2 * motion::Motor::kMaxPosition || steps < -2 * motion::Motor::kMaxPosition) {
    return fail(motor.name() + ": " + std::to_string(steps) +
                " steps is out of range; allowed: +-" +
                std::to_string(motion::Motor::kMaxPosition));
  }
  const auto refuse = [&motor](const Error& why) { return fail(motor.name() + ": " + why.text()); };
  if (const auto may = interlocks_.may_move(id); !may) return refuse(may.error());
  const auto from = absolute ? Result<units::Steps>() : motor.reach().distance_from();
  if (!from) return refuse(from.error());
  const units::Steps target = *from + *counted;
  if (const auto may = motor.reach().may_move_to(target.whole, shortest_delay); !may)
    return refuse(may.error());
  return target;
}

// A motor that moves is given to another move: what it was moving or stopping for has ended.
void Moves::take_over(const std::vector<MotorId>& motors, const api::Asker& by) {
  for (const MotorId motor : motors) {
    installation_[motor].set_jogs(false);
    open_.not_stopped(motor);
    open_.end(motor, api::Outcome::kStopped,
              "was given a new target by " + text_of(by) + "; it moves on");
  }
}

void Moves::jog(std::int64_t now_us, const api::Asker& asker, MotorId id, std::int64_t target,
                bushd_delay shortest_delay) {
  while (begins()) begin_next();
  motion::Motor& motor = installation_[id];
  if (motor.has_plan()) take_over({id}, asker);
  open_.open(asker, {id}, OpenMoves::Purpose::kJog);
  motor.set_jogs(true);
  motor.go_on({});
  if (!motor.stands()) return redirect(now_us, id, target, shortest_delay);
  open_.planned(id, 1, motor.axis().most_steps_per_s(shortest_delay));
  start_run(now_us, id, {.target = target, .shortest_delay = shortest_delay});
}

void Moves::redirect(std::int64_t now_us, MotorId id, std::int64_t target,
                     bushd_delay shortest_delay) {
  if (motion::is_withdrawn(installation_[id])) starts_.begin({id});
  installation_[id].aim(target, shortest_delay);
  open_.planned(id, 1, installation_[id].axis().most_steps_per_s(shortest_delay));
  retarget(now_us, {id});
}

Result<std::int64_t> Moves::go_on(std::int64_t now_us, MotorId id, const api::Amount& position) {
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  const auto part = part_of(id, position, {.kind = api::Move::Kind::kAbsolute});
  if (!part) return fail(part.error());
  installation_[id].go_on({part->legs.begin() + 1, part->legs.end()});
  installation_[id].ask_for(part->target);
  start_run(now_us, id, part->legs.front());
  return part->legs.back().target;
}

void Moves::begin_on_line(const std::vector<MotorId>& motors,
                          const std::shared_ptr<link::LinePace>& pace) {
  if (!may_begin(motors)) return;
  for (const MotorId id : motors) {
    const motion::Axis& axis = installation_[id].axis();
    const bool in_mcus = axis.line() && axis.line()->in_mcus;
    journal_.started(id, axis.target_steps() - axis.from_steps(), axis.start_tick(), 0, in_mcus);
    Mcu& mcu = installation_.mcu_of(id);
    const std::uint8_t output = installation_[id].output().value;
    if (pace) {
      mcu.offers.paced_lines->begin_in_pace(mcu.on_bus(), output, axis.start_tick(),
                                            link::LinePace::Place(pace));
      continue;
    }
    // One that makes no step of it only waits.
    if (axis.end_tick() <= axis.start_tick()) continue;
    if (in_mcus) {
      mcu.offers.line_runs->begin_line_run(mcu.on_bus(), output, axis.start_tick(),
                                           mcu.line_run(axis));
    } else {
      mcu.bus().begin(mcu.on_bus(), output, axis.start_tick());
    }
  }
  installation_.changed = true;
}

void Moves::redirect_on_line(std::int64_t now_us, const std::vector<MotorId>& motors) {
  retarget(now_us, motors);
}

void Moves::pause(std::int64_t now_us, const std::vector<MotorId>& motors) {
  while (begins()) begin_next();
  std::vector<MotorId> changed;
  for (const MotorId id : motors) {
    if (motion::is_late(installation_[id])) {
      pause_late(id);
      continue;
    }
    installation_[id].pause();
    if (installation_[id].axis().needs_change()) changed.push_back(id);
  }
  replan(now_us, changed);
}

void Moves::resume(std::int64_t now_us, const std::vector<MotorId>& motors) {
  std::vector<MotorId> moving;
  for (const MotorId id : motors) {
    motion::Motor& motor = installation_[id];
    if (!motor.is_paused()) continue;
    const bool stands = motor.stands_paused();
    motor.resume();
    if (motor.is<motion::OnLine>()) continue;  // who leads the line begins its next run
    if (stands) {
      start_leg(now_us, id);
    } else {
      moving.push_back(id);
    }
  }
  retarget(now_us, moving);
}

void Moves::stop(std::int64_t now_us, const std::vector<MotorId>& motors) {
  std::vector<MotorId> changed;
  std::vector<MotorId> armed;
  for (const MotorId id : installation_.with_lines(motors)) {
    if (unbegun_.contains(id) || motion::is_late(installation_[id])) {
      cancel(id, "stopped before it began");
      continue;
    }
    motion::Motor& motor = installation_[id];
    motor.stop();
    if (motor.is<motion::Armed>()) armed.push_back(id);
    if (motor.axis().needs_change()) changed.push_back(id);
  }
  disarm(armed);
  replan(now_us, changed);
}

void Moves::disarm(const std::vector<MotorId>& motors) {
  for (const McuId id : installation_.mcus_of(motors)) {
    const Mcu& mcu = installation_[id];
    mcu.offers.trigger->disarm(mcu.on_bus());
  }
}

// This motor waits no more: so do those that were armed with it. Those of its own MCU have ended by
// what has ended it.
void Moves::cancel_armed_group(MotorId ended) {
  std::vector<MotorId> others;
  for (const MotorId id : installation_.motors()) {
    motion::Motor& motor = installation_[id];
    const motion::Armed* armed = motor.as<motion::Armed>();
    if (armed == nullptr || armed->stops || !open_.together(id, ended) ||
        installation_.config()[id].mcu == installation_.config()[ended].mcu) {
      continue;
    }
    motor.stop(installation_[ended].name() + ", armed with it, does not wait any more");
    others.push_back(id);
  }
  disarm(others);
}

void Moves::retarget(std::int64_t now_us, const std::vector<MotorId>& motors) {
  to_retarget_.insert(motors.begin(), motors.end());
  step(now_us);
}

void Moves::step(std::int64_t now_us) {
  start_anew(now_us);
  std::vector<MotorId> now;
  std::erase_if(to_retarget_, [&](MotorId id) {
    const bool needed = installation_[id].axis().needs_change();
    if (needed && !has_time_to_retarget(now_us, id)) return false;
    if (needed) now.push_back(id);
    return true;
  });
  if (!now.empty()) replan(now_us, now);
}

// All MCUs of a line have to have time.
bool Moves::has_time_to_retarget(std::int64_t now_us, MotorId motor) const {
  return std::ranges::all_of(installation_.with_lines({motor}), [&](MotorId id) {
    const Mcu& mcu = installation_.mcu_of(id);
    const link::SharedLine* line = mcu.offers.shared_line;
    return line == nullptr || line->has_time_to_retarget(now_us, mcu.on_bus());
  });
}

void Moves::take(std::int64_t now_us, MotorId id, const std::vector<motion::Event>& events) {
  motion::Motor& motor = installation_[id];
  Mcu& mcu = installation_.mcu_of(id);
  follow_start(id);
  for (const motion::Event& event : events) {
    if (!std::holds_alternative<motion::event::Executed>(event)) installation_.changed = true;
    std::visit(
        Overloaded{
            [](const motion::event::Waits&) {},
            [&](const motion::event::Started& started) {
              journal_.started(id, started.steps, started.start, started.late_ns, true);
              // Perhaps it is over already, by the same report.
              mcu.offers.trigger->follow_run(mcu.on_bus(), motor.output().value, started.start,
                                             run_begun(mcu, motor.axis(), started));
            },
            [&](const motion::event::Executed& executed) { journal_.changed(id, executed.change); },
            [&](const motion::event::Replan&) {
              if (motor.axis().stopping()) return replan(now_us, {id});
              retarget(now_us, {id});
            },
            [&](const motion::event::Drop&) { mcu.bus().drop(mcu.on_bus(), motor.output().value); },
            [&](const motion::event::Mismatch& mismatch) {
              starts_.leaves(id);
              outputs_.log(LogLevel::kError, id,
                           motor.name() + ": " + *motor.trust().uncertain_reason() +
                               (mismatch.stopped ? "; it is stopped"
                                                 : "; it is left to the other master on the bus, "
                                                   "only an emergency stop reaches it"));
            },
            [&](const motion::event::MissedStart&) { misses_start(id); },
            [&](const motion::event::Turn&) {
              journal_.ended(id, "turned");
              start_leg(now_us, id);
            },
            [&](const motion::event::NextLeg&) {
              journal_.ended(id, api::word(api::Outcome::kReached));
              start_leg(now_us, id);
            },
            [&](const motion::event::Paused&) {
              journal_.ended(id, api::word(api::Outcome::kStopped));
            },
            [&](const motion::event::StandsOnLine& stands) {
              journal_.ended(id, stands.at_target ? api::word(api::Outcome::kReached) : "turned");
            },
            [&](const motion::event::Ended& ended) { end(id, ended); }},
        event);
  }
}

void Moves::end(MotorId id, const motion::event::Ended& ended) {
  const motion::Motor& motor = installation_[id];
  const bool begun = unbegun_.erase(id) == 0;
  if (starts_.waits(id) && begun && has_moved(id)) starts_.begins(id);
  starts_.leaves(id);
  Mcu& mcu = installation_.mcu_of(id);
  if (begun) mcu.bus().drop(mcu.on_bus(), motor.output().value);
  if (ended.was_armed) {
    cancel_armed_group(id);
  } else if (begun && !ended.was_paused) {
    // The log of moves knows nothing of one that has not started, and that a paused one stands.
    journal_.ended(id, api::word(ended.outcome));
  }
  const bool planned =
      ended.outcome == api::Outcome::kReached || ended.outcome == api::Outcome::kStopped;
  if (!planned) outputs_.log(LogLevel::kWarning, id, motor.name() + ": " + ended.reason);
  open_.end(id, ended.outcome, ended.reason, ended.by_plan);
}

void Moves::goes_offline(Mcu& mcu, const std::string& cause) {
  for (const MotorId id : mcu.motors()) {
    const auto ended = installation_[id].end(api::Outcome::kLink,
                                             cause + "; the position is the last one reported");
    if (ended) end(id, *ended);
  }
}

std::int64_t Moves::rest_by_us(std::int64_t now_us) const {
  std::int64_t latest_us = now_us;
  for (const MotorId id : installation_.motors()) {
    const motion::Motor& motor = installation_[id];
    const Bus& bus = installation_.bus_of(installation_.mcu_of(id));
    if (!motor.moves() || !bus.master.time_known()) continue;
    const motion::Tick ticks = motor.axis().over_tick() - bus.master.tick_at(now_us);
    latest_us = std::max(latest_us, now_us + ticks * bus.config.tick_us);
  }
  return latest_us;
}

}  // namespace bushd::daemon
