#include "daemon/services/positions.h"

#include <algorithm>
#include <utility>

#include "daemon/services/open_moves.h"

namespace bushd::daemon {
namespace {}  // namespace

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
  return std::ranges::any_of(open_, [motor](const Setting& setting) {
    return std::ranges::find(setting.parts, motor, &Part::motor) != setting.parts.end();
  });
}

void Positions::request(std::int64_t now_us, const api::Asker& asker,
                        const api::SetPosition& request) {
  auto plan = plan_of(request);
  if (!plan) return asker.answer(api::Refused{plan.error().text()});
  for (Offset& offset : plan->offsets) {
    const units::Coordinates before = installation_[offset.motor].coordinates();
    installation_[offset.motor].set_coordinates(std::move(offset.coordinates));
    journal_.offset_set(offset.motor, asker);
    if (offset_listener_) offset_listener_(offset.motor, before, asker);
    installation_.changed = true;
  }
  std::vector<MotorId> motors;
  for (const Part& part : plan->parts) motors.push_back(part.motor);
  open_.push_back({Confirmation(asker, installation_.mcus_of(motors), now_us), {}});
  for (const auto& [id, steps, from_steps] : plan->parts) {
    installation_.mcu_of(id).set_position(installation_[id].output(), steps);
  }
  open_.back().parts = std::move(plan->parts);
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
    return fail(motor.busy_text() + "; its position can be set at rest only");
  }
  if (being_set(id)) {
    return fail(motor.name() + ": its position is being set; wait for that result");
  }
  return {};
}

Result<void> Positions::add(MotorId id, const api::Amount& position, bool dial, Plan& plan) const {
  const motion::Motor& motor = installation_[id];
  const units::Coordinates& coordinates = motor.coordinates();
  const auto* user = std::get_if<api::UserUnits>(&position);
  if (user != nullptr && !dial && coordinates.has_unit()) {
    if (motor.uncertain_reason()) {
      return fail("its position is uncertain, because " + *motor.uncertain_reason() +
                  "; home it, or say where it stands on the dial ('bushctl set NAME --dial')");
    }
    auto moved = coordinates.with_user(user->value, motor.position_steps());
    if (!moved) return fail(moved.error());
    plan.offsets.push_back({id, std::move(*moved)});
    return {};
  }
  const auto steps = user != nullptr && dial ? coordinates.steps_of_dial(user->value)
                                             : motor.steps_of_position(position);
  if (!steps) return fail(steps.error());
  if (*steps > motion::Motor::kMaxPosition || *steps < -motion::Motor::kMaxPosition) {
    return fail("positions lie within +-" + std::to_string(motion::Motor::kMaxPosition));
  }
  plan.parts.push_back({id, static_cast<std::int32_t>(*steps), motor.position_steps()});
  return {};
}

void Positions::follow(std::int64_t now_us, const Mcu* reported) {
  for (auto it = open_.begin(); it != open_.end();) {
    const auto check = [&](const Mcu& mcu) -> Result<void> {
      for (const auto& [id, steps, from_steps] : it->parts) {
        const motion::Motor& motor = installation_[id];
        if (installation_.config()[id].mcu == mcu.id && motor.position_steps() != steps) {
          return fail("did not take the position of " + motor.name());
        }
      }
      return {};
    };
    const auto ended = it->confirmation.follow(now_us, reported, installation_, check);
    if (!ended) {
      ++it;
      continue;
    }
    const Setting finished = std::move(*it);
    it = open_.erase(it);
    end(finished, *ended);
  }
}

void Positions::end(const Setting& setting, const Result<void>& ended) {
  for (const Part& part : setting.parts) {
    if (!ended) break;
    motion::Motor& motor = installation_[part.motor];
    motor.position_is_known();
    const api::Asker& by = setting.confirmation.asker();
    journal_.position_set(part.motor, part.from_steps, by);
    if (listener_) listener_(part.motor, part.from_steps, by);
    outputs_.log(LogLevel::kInfo, part.motor,
                 motor.name() + ": position set to " + std::to_string(part.steps) + ", was " +
                     std::to_string(part.from_steps) + ", by " + text_of(by));
  }
  installation_.changed = true;
  setting.confirmation.answer(ended);
}

}  // namespace bushd::daemon
