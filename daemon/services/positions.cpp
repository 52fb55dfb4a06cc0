#include "daemon/services/positions.h"

#include <algorithm>
#include <utility>

#include "daemon/services/open_moves.h"
#include "words/remedy.h"

namespace bushd::daemon {

Positions::Positions(Installation& installation, Interlocks& interlocks, Journal& journal,
                     Outputs& outputs)
    : installation_(installation), journal_(journal), outputs_(outputs) {
  // A move begins where the motor stands when it is accepted.
  interlocks.add([this](MotorId motor) -> Result<void> {
    if (!being_set(motor)) return {};
    return fail("its position is being set; wait for that result");
  });
}

bool Positions::being_set(MotorId motor) const {
  return counter_being_set(motor) || std::ranges::any_of(open_, [motor](const Setting& setting) {
           return std::ranges::find(setting.offsets, motor, &Offset::motor) !=
                  setting.offsets.end();
         });
}

bool Positions::counter_being_set(MotorId motor) const {
  return std::ranges::any_of(open_, [motor](const Setting& setting) {
    return std::ranges::find(setting.parts, motor, &Part::motor) != setting.parts.end();
  });
}

void Positions::request(std::int64_t now_us, const api::Asker& asker,
                        const api::SetPosition& request) {
  auto plan = plan_of(request);
  if (!plan) return asker.answer(api::Refused{plan.error().text()});
  std::vector<MotorId> motors;
  for (const Part& part : plan->parts) motors.push_back(part.motor);
  open_.push_back({Confirmation(asker, installation_.mcus_of(motors), now_us), {}, {}});
  for (const auto& [id, steps, from_steps] : plan->parts) {
    Mcu& mcu = installation_.mcu_of(id);
    mcu.bus().set_position(mcu.on_bus(), installation_[id].output().value, steps);
  }
  open_.back().parts = std::move(plan->parts);
  open_.back().offsets = std::move(plan->offsets);
  // Offsets alone wait for nobody.
  if (open_.back().parts.empty()) follow(now_us, nullptr);
}

Result<Positions::Plan> Positions::plan_of(const api::SetPosition& request) const {
  const auto motors = installation_.find(request.motors);
  if (!motors) return fail(motors.error());
  Plan plan;
  for (std::size_t i = 0; i < motors->size(); ++i) {
    const MotorId id = (*motors)[i];
    if (auto may = may_be_set(id); !may) return fail(may.error());
    if (auto added = add(id, request.motors[i].amount, request.dial, plan); !added) {
      return fail(installation_[id].name() + ": " + added.error().message);
    }
  }
  for (const MotorId id : *motors) {
    if (const auto online = installation_.mcu_of(id).must_be_online(); !online) {
      return fail(online.error());
    }
  }
  return plan;
}

Result<void> Positions::may_be_set(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  if (!motor.is<motion::Resting>()) {
    return fail(motion::busy_text(motor) + "; its position can be set at rest only");
  }
  if (being_set(id)) {
    return fail(motor.name() + ": its position is being set; wait for that result");
  }
  return {};
}

Result<void> Positions::add(MotorId id, const api::Amount& position, bool dial, Plan& plan) const {
  const motion::Motor& motor = installation_[id];
  const units::Coordinates& coordinates = motor.scale().coordinates();
  const auto* user = std::get_if<api::UserUnits>(&position);
  if (user != nullptr && !dial && coordinates.has_unit()) {
    if (motor.trust().uncertain_reason()) {
      return fail(
          "its position is uncertain, because " + *motor.trust().uncertain_reason() +
          "; home it, or say where it stands on the dial: " + words::set_remedy(motor.name()));
    }
    auto moved = coordinates.with_user(user->value, motor.position_steps());
    if (!moved) return fail(moved.error());
    plan.offsets.push_back({id, std::move(*moved)});
    return {};
  }
  const auto steps = user != nullptr && dial ? coordinates.steps_of_dial(user->value)
                                             : motor.scale().steps_of_position(position);
  if (!steps) return fail(steps.error());
  if (*steps > motion::Motor::kMaxPosition || *steps < -motion::Motor::kMaxPosition) {
    return fail("positions lie within +-" + std::to_string(motion::Motor::kMaxPosition));
  }
  plan.parts.push_back({id, static_cast<std::int32_t>(*steps), motor.position_steps()});
  return {};
}

void Positions::follow(std::int64_t now_us, const Mcu* reported) {
  // All that have been asked are waited for: what each has done is judged in the end.
  const auto any = [](const Mcu&) -> Result<void> { return {}; };
  for (auto it = open_.begin(); it != open_.end();) {
    const auto confirmed = it->confirmation.follow(now_us, reported, installation_, any);
    if (!confirmed) {
      ++it;
      continue;
    }
    Setting finished = std::move(*it);
    it = open_.erase(it);
    end(finished, *confirmed);
  }
}

bool Positions::is_set(const Setting& setting, const Part& part) const {
  return !setting.confirmation.awaits(installation_.config()[part.motor].mcu) &&
         installation_[part.motor].position_steps() == part.steps;
}

// Which half is done where not all of it is.
Result<void> Positions::outcome(const Setting& setting, const Result<void>& confirmed) const {
  std::string done;
  std::string missing;
  std::string why = confirmed ? std::string() : confirmed.error().text();
  const auto add = [this](std::string& list, MotorId motor) {
    list += (list.empty() ? "" : ", ") + installation_[motor].name();
  };
  for (const Part& part : setting.parts) {
    const bool is_set = this->is_set(setting, part);
    add(is_set ? done : missing, part.motor);
    if (is_set || !why.empty()) continue;
    why = "MCU " + installation_.mcu_of(part.motor).name() + " did not take the position of " +
          installation_[part.motor].name();
  }
  if (missing.empty()) return {};
  for (const Offset& offset : setting.offsets) add(missing, offset.motor);
  return fail(why + "; set: " + (done.empty() ? "none" : done) + "; not set: " + missing);
}

void Positions::put(Offset& offset, const api::Asker& by) {
  motion::Motor& motor = installation_[offset.motor];
  const units::Coordinates before = motor.scale().coordinates();
  motor.scale().set_coordinates(std::move(offset.coordinates));
  motor.ask_for({});
  journal_.offset_set(offset.motor, by);
  if (offset_listener_) offset_listener_(offset.motor, before, by);
}

void Positions::note(const Part& part, const api::Asker& by) {
  motion::Motor& motor = installation_[part.motor];
  motor.trust().is_known();
  motor.ask_for({});
  journal_.position_set(part.motor, part.from_steps, by);
  if (listener_) listener_(part.motor, part.from_steps, by);
  outputs_.log(LogLevel::kInfo, part.motor,
               motor.name() + ": position set to " + std::to_string(part.steps) + ", was " +
                   std::to_string(part.from_steps) + ", by " + text_of(by));
}

void Positions::end(Setting& setting, const Result<void>& confirmed) {
  const api::Asker& by = setting.confirmation.asker();
  const Result<void> outcome = this->outcome(setting, confirmed);
  for (const Part& part : setting.parts) {
    if (is_set(setting, part)) note(part, by);
  }
  if (outcome) {
    for (Offset& offset : setting.offsets) put(offset, by);
  }
  installation_.changed = true;
  api::Completed answer = Confirmation::result_of(outcome);
  // A counter that is set has its mark: what is lost of it is not believed.
  if (answerer_ && !setting.offsets.empty()) return answerer_(by, std::move(answer));
  by.answer(answer);
}

}  // namespace bushd::daemon
