#include "daemon/services/trigger.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "daemon/services/allowed.h"
#include "words/remedy.h"

namespace bushd::daemon {

Result<void> check_trigger_delay(std::int64_t delay_us) {
  constexpr auto kAllowed = api::Arm::kDelayUs;
  static_assert(kAllowed.least == BUSHD_TRIGGER_MIN_DELAY_US &&
                kAllowed.most == BUSHD_TRIGGER_MAX_DELAY_US);
  if (kAllowed.has(delay_us)) return {};
  return fail("a delay of " + std::to_string(delay_us) + " us after the trigger" +
              allowed(kAllowed));
}

void Trigger::request(const api::Asker& asker, const api::Arm& request) {
  const auto motors = motors_of(request);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  open_moves_.open(asker, *motors, OpenMoves::Purpose::kArm);
  std::map<McuId, std::vector<link::Trigger::Armed>> moves;
  const std::vector<std::int64_t> steps = steps_of(*motors, request);
  for (std::size_t i = 0; i < motors->size(); ++i) {
    const MotorId motor = (*motors)[i];
    moves[installation_.config()[motor].mcu].push_back(
        {.motor = installation_[motor].output().value,
         .run = {static_cast<std::int32_t>(steps[i]), shortest_delay_of(motor, request)}});
  }
  const auto edge = request.edge == api::Edge::kRising ? BUSHD_EDGE_RISING : BUSHD_EDGE_FALLING;
  std::map<McuId, std::uint8_t> numbers;
  for (const auto& [id, of_mcu] : moves) {
    const Mcu& mcu = installation_[id];
    numbers[id] = mcu.offers.trigger->arm(mcu.on_bus(), edge,
                                          static_cast<std::uint32_t>(request.delay_us), of_mcu);
  }
  for (std::size_t i = 0; i < motors->size(); ++i) {
    const MotorId motor = (*motors)[i];
    installation_[motor].ask_for(target_of(motor, request.motors[i].amount, request));
    installation_[motor].arm(numbers[installation_.config()[motor].mcu], steps[i],
                             shortest_delay_of(motor, request));
  }
  installation_.changed = true;
}

Result<std::vector<MotorId>> Trigger::motors_of(const api::Arm& request) const {
  auto motors = installation_.find(request.motors);
  if (!motors) return motors;
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  for (std::size_t i = 0; i < motors->size(); ++i) {
    const auto shortest_delay = moves_.shortest_delay_of((*motors)[i], request.speed);
    if (!shortest_delay) return fail(shortest_delay.error());
    const auto target = moves_.target_of((*motors)[i], request.motors[i].amount,
                                         api::Move::Kind::kRelative, *shortest_delay);
    if (!target) return fail(target.error());
  }
  if (const auto delay = check_trigger_delay(request.delay_us); !delay) return fail(delay.error());
  const std::vector<std::int64_t> steps = steps_of(*motors, request);
  for (std::size_t i = 0; i < motors->size(); ++i) {
    if (auto may = may_arm((*motors)[i], steps[i], request); !may) return fail(may.error());
  }
  return motors;
}

// Precondition, as of what follows: motors_of has no objection.
bushd_delay Trigger::shortest_delay_of(MotorId motor, const api::Arm& request) const {
  return *moves_.shortest_delay_of(motor, request.speed);
}

units::Steps Trigger::target_of(MotorId motor, const api::Amount& amount,
                                const api::Arm& request) const {
  return *moves_.target_of(motor, amount, api::Move::Kind::kRelative,
                           shortest_delay_of(motor, request));
}

std::vector<std::int64_t> Trigger::steps_of(const std::vector<MotorId>& motors,
                                            const api::Arm& request) const {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const motion::Motor& motor = installation_[motors[i]];
    steps.push_back(target_of(motors[i], request.motors[i].amount, request).whole -
                    motor.position_steps());
  }
  return steps;
}

Result<void> Trigger::may_arm(MotorId id, std::int64_t steps, const api::Arm& request) const {
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  if (steps == 0) return fail(motor.name() + ": a move of no steps");
  if (motor.has_plan()) {
    return fail(motor.name() + " moves; run " + words::remedy("stop", motor.name()) + " first");
  }
  if (!mcu.can_trigger() || !mcu.can_run_tables()) {
    return fail(motor.name() + ": MCU " + mcu.name() +
                " has no trigger input; move it without one, or by an MCU that has");
  }
  if (!bushd_delay_is_code(shortest_delay_of(id, request)) && !mcu.can_run_slowly()) {
    return fail(fmt::format(
        "{}: MCU {} makes no steps that are so slow by itself; ask for {:.6g} steps/s or more "
        "(--speed --steps), or move it without a trigger",
        motor.name(), mcu.name(), 1e9 / UINT16_MAX / motor.axis().time_unit_ns()));
  }
  for (const MotorId other : mcu.motors()) {
    if (!installation_[other].is<motion::Armed>()) continue;
    return fail(installation_[other].name() + " waits for the trigger of MCU " + mcu.name() +
                " already" + open_moves_.asked_for_by(other) + "; run " +
                words::remedy("disarm", installation_[other].name()) + " first");
  }
  return {};
}

void Trigger::request(const api::Asker& asker, const api::Disarm& request) {
  auto [motors, unknown] = installation_.find_known(request.motors, false);
  if (motors.empty()) return asker.answer(api::Refused{unknown});
  // Where all motors are meant, those count that were lost while they waited or moved.
  const bool may_begin =
      !request.motors.empty() || std::ranges::any_of(motors, [this](MotorId motor) {
        return installation_[motor].trust().lost_in_motion();
      });
  const std::string mcus = installation_.not_online(motors);
  const std::string away =
      mcus.empty() ? "" : "; not online, so it is unknown whether they stand:" + mcus;
  std::erase_if(motors,
                [this](MotorId motor) { return !installation_[motor].is<motion::Armed>(); });
  open_moves_.stopped_by(motors, text_of(asker));
  for (const McuId id : installation_.mcus_of(motors)) {
    const Mcu& mcu = installation_[id];
    mcu.offers.trigger->disarm(mcu.on_bus());
  }
  if (!unknown.empty() || (may_begin && !mcus.empty())) {
    return asker.answer(api::Completed{
        .outcome = unknown.empty() ? api::Outcome::kLink : api::Outcome::kFault,
        .reason = "what waits is being disarmed" + away + (unknown.empty() ? "" : "; " + unknown),
        .detail = {}});
  }
  asker.answer(api::Accepted{});
  open_.add({.asker = asker, .motors = std::move(motors), .done = "done" + away},
            api::done("carried out; its end is not waited for"));
}

void Trigger::follow() {
  open_.follow([this](Disarming& disarming) {
    std::erase_if(disarming.motors, [&](MotorId id) {
      const motion::Motor& motor = installation_[id];
      if (motor.is<motion::Armed>()) return false;
      if (motor.moves()) {
        disarming.done = motor.name() + " moves: the trigger came before it was disarmed";
      }
      return true;
    });
    if (!disarming.motors.empty()) return false;
    installation_.changed = true;
    disarming.asker.answer(api::done(disarming.done));
    return true;
  });
}

}  // namespace bushd::daemon
