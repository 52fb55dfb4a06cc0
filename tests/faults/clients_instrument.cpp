// What clients ask of an instrument: moves in user units, with speeds and with legs, jogs, pauses,
// and other settings.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "clients.h"
#include "request.h"

namespace bushfaults {

// The same in user units: exactly; positions a little beside, at the farthest a tie, or about at a
// limit. Distances are whole steps, so that it does not matter what the motor was told before.
Request Clients::move_of_user() {
  Request request = move_or_retarget();
  const Units& units = witness_.units();
  request.user = true;
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    const std::size_t motor = index_of(request.motors[i]);
    const auto limits = units.limits(motor);
    std::int64_t& amount = request.steps[i];
    const bool absolute = request.ask == Ask::kMoveTo;
    if (absolute && limits && random_.one_in(3)) {
      amount = (random_.one_in(2) ? limits->low : limits->high) + random_.between(-2, 2);
    }
    const std::int64_t step = std::abs(units.micro_of_distance(motor, 1));
    const auto position = units.user_of(motor, amount);
    amount = absolute ? position.value_or(0) : units.micro_of_distance(motor, amount);
    if (absolute && units.has_unit(motor)) amount += random_.between(-step / 2, step / 2);
  }
  return request;
}

// Either offsets or positions: of both the offsets change when the MCUs have answered, which the
// witness does not see.
Request Clients::set_of_user() {
  Request request = make(Ask::kSetPosition);
  request.user = true;
  request.dial = random_.one_in(2);
  std::vector<Choice> some = motors_that(false, false);
  for (std::int64_t n = random_.between(1, 2); n > 0 && !some.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(some.size()));
    const std::size_t motor = index_of(some[index].name);
    const std::int64_t step = std::abs(witness_.units().micro_of_distance(motor, 1));
    const std::int64_t beside =
        witness_.units().has_unit(motor) ? random_.between(-step / 2, step / 2) : 0;
    request.add(some[index].name,
                random_.between(-kFarthestSteps / 4, kFarthestSteps / 4) * step + beside);
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(index));
    std::erase_if(some, [&](const Choice& other) {
      return !request.dial &&
             witness_.units().has_unit(index_of(other.name)) != witness_.units().has_unit(motor);
    });
  }
  if (request.motors.empty()) request.add(any_motor(), 0);
  return request;
}

// A move of a motor at rest, or a change in flight.
Request Clients::move_at_speed() {
  Request request = random_.one_in(3) ? move_of_user() : move_or_retarget();
  const std::int64_t steps_per_s = random_.magnitude(300, 4000);
  request.speed_in_steps = random_.one_in(2) || request.motors.size() != 1;
  const std::int64_t step =
      request.speed_in_steps
          ? 1'000'000
          : std::abs(witness_.units().micro_of_distance(index_of(request.motors.front()), 1));
  request.speed_micro = steps_per_s * step;
  return request;
}

// In steps or in user units, with a speed or without; of those that have backlash.
Request Clients::move_with_legs() {
  Request request = random_.one_in(3) ? move_of_user() : move_or_retarget();
  for (std::size_t i = request.motors.size(); i-- > 0 && request.motors.size() > 1;) {
    if (config_.motors[index_of(request.motors[i])].backlash != 0) continue;
    request.motors.erase(request.motors.begin() + static_cast<std::ptrdiff_t>(i));
    request.steps.erase(request.steps.begin() + static_cast<std::ptrdiff_t>(i));
  }
  // Sometimes so near that it may be straight.
  if (random_.one_in(2)) {
    for (std::int64_t& amount : request.steps) {
      if (request.ask == Ask::kMoveBy && !request.user) amount = random_.between(-500, 500);
    }
  }
  return request;
}

// A line of motors without backlash, as far as there are any: the witness does not know what the
// legs of a line are. The motors are at rest, but for a few: those are refused, or a line of one
// motor gets another end. Every second line is of motors with one table and equal ways, so that
// MCUs can make it themselves.
Request Clients::move_along_line() {
  Request request = move(static_cast<std::size_t>(random_.between(2, 6)));
  const bool equal = random_.one_in(2);
  const auto group_of = [this](const std::string& motor) {
    return config_.motors[index_of(motor)].group;
  };
  for (std::size_t i = request.motors.size(); i-- > 0 && request.motors.size() > 1;) {
    const bool other =
        equal && i != 0 && group_of(request.motors[i]) != group_of(request.motors[0]);
    if (config_.motors[index_of(request.motors[i])].backlash == 0 && !other) continue;
    request.motors.erase(request.motors.begin() + static_cast<std::ptrdiff_t>(i));
    request.steps.erase(request.steps.begin() + static_cast<std::ptrdiff_t>(i));
  }
  request.line = config_.motors[index_of(request.motors.front())].backlash == 0;
  if (equal && request.line) {
    request.ask = Ask::kMoveBy;
    request.user = false;
    const std::int64_t way = random_.between(1, 6000);
    for (std::int64_t& steps : request.steps) steps = steps < 0 ? -way : way;
  }
  if (random_.one_in(4)) {
    request.speed_micro = random_.magnitude(100, 3'000) * 1'000'000;
    request.speed_in_steps = true;
  }
  if (request.line && random_of_laws_.one_in(3)) be_elementary(request);
  return request;
}

// All of one MCU: the law has one order of steps.
void Clients::be_elementary(Request& line) const {
  const bushd::McuId mcu = config_.motors[index_of(line.motors.front())].mcu;
  for (std::size_t i = line.motors.size(); i-- > 1;) {
    if (config_.motors[index_of(line.motors[i])].mcu == mcu) continue;
    line.motors.erase(line.motors.begin() + static_cast<std::ptrdiff_t>(i));
    line.steps.erase(line.steps.begin() + static_cast<std::ptrdiff_t>(i));
  }
  line.elementary = true;
}

// Every second one of motors with one table and equal ways. Most others get a table of their own
// first, and are refused where that cannot be.
Request Clients::arm_line() {
  Request request = make(Ask::kArm);
  request.line = true;
  request.rising = random_.one_in(2);
  request.delay_us = static_cast<std::int32_t>(random_.magnitude(50, 1'500'000));
  std::vector<Choice> free = motors_that(false, false);
  std::erase_if(free, [this](const Choice& choice) {
    return config_.motors[index_of(choice.name)].backlash != 0;
  });
  const bool equal = random_.one_in(2);
  const std::int64_t way = random_.magnitude(1, 6000);
  for (std::int64_t n = random_.between(2, 5); n > 0 && !free.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(free.size()));
    std::int64_t steps = equal ? way : random_.magnitude(1, 6000);
    if (random_.one_in(2)) steps = -steps;
    if (std::abs(free[index].position_steps + steps) > kFarthestSteps) steps = -steps;
    request.add(free[index].name, steps);
    const auto group = config_.motors[index_of(free[index].name)].group;
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(index));
    if (!equal) continue;
    std::erase_if(free, [&](const Choice& choice) {
      return config_.motors[index_of(choice.name)].group != group;
    });
  }
  return request.motors.empty() ? arm() : request;
}

Request Clients::jog() {
  std::vector<Choice> some = motors_that(random_.one_in(4), false);
  return joggers_.begin(some.empty() ? any_motor() : random_.pick(some).name);
}

std::vector<std::string> Clients::motors_with(bool bushd::api::MotorState::* flag) const {
  std::vector<std::string> found;
  for (const auto& state : witness_.states()) {
    if (!state) continue;
    for (const bushd::api::MotorState& motor : state->motors) {
      if (motor.*flag) found.push_back(motor.name);
    }
  }
  return found;
}

// A request for one to eight of these motors; for all, now and then.
Request Clients::of_some(Ask ask, std::vector<std::string> motors) {
  Request request = make(ask);
  if (random_.one_in(8)) return request;
  for (std::int64_t n = random_.magnitude(1, 8); n > 0 && !motors.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(motors.size()));
    request.add(motors[index], 0);
    motors.erase(motors.begin() + static_cast<std::ptrdiff_t>(index));
  }
  if (request.motors.empty()) request.add(any_motor(), 0);
  return request;
}

Request Clients::pause_or_hold() {
  switch (random_.below(8)) {
    case 0:
      return of_some(Ask::kHold, {any_motor(), config_.motors.front().name});
    case 1:
      return of_some(Ask::kRelease, motors_with(&bushd::api::MotorState::held));
    case 2:
    case 3:
      return of_some(Ask::kResume, motors_with(&bushd::api::MotorState::paused));
    default:
      return of_some(Ask::kPause, motors_with(&bushd::api::MotorState::moving));
  }
}

// What is paused or held is not left so for long.
std::optional<Request> Clients::remedy_of_pauses() {
  const auto held = motors_with(&bushd::api::MotorState::held);
  if (!held.empty() && random_.one_in(6)) return make(Ask::kRelease);
  const auto paused = motors_with(&bushd::api::MotorState::paused);
  if (!paused.empty() && random_.one_in(6)) return of_some(Ask::kResume, paused);
  return std::nullopt;
}

Request Clients::change_settings() {
  Request request = make(Ask::kConfigure);
  std::vector<Choice> some = motors_that(random_.one_in(20), false);
  const std::string motor = some.empty() ? any_motor() : random_.pick(some).name;
  const std::int64_t step = std::abs(witness_.units().micro_of_distance(index_of(motor), 1));
  for (std::int64_t n = random_.between(1, 2); n > 0; --n) {
    Setting setting{.key = static_cast<Setting::Key>(random_.below(3))};
    if (setting.key == Setting::Key::kOffset) setting.low = random_.between(-50, 50) * kMicro + n;
    if (setting.key == Setting::Key::kDirection) setting.low = random_.one_in(2) ? 1 : -1;
    if (setting.key == Setting::Key::kSoftLimits) {
      setting.none = random_.one_in(3);
      setting.low = -random_.magnitude(10, 15'000) * step - random_.between(0, 999);
      setting.high = random_.magnitude(10, 15'000) * step + random_.between(0, 999);
    }
    request.add(motor, 0);
    request.settings.push_back(setting);
  }
  return request;
}

Request Clients::of_program() {
  const std::size_t number = programs_.any_motor();
  const bushd::MotorId motor = config_.crates.front().modules.front().motors[number];
  const auto& state = witness_.states()[config_[motor].mcu.value];
  std::int64_t position_steps = 0;
  if (state) {
    const auto& motors = state->motors;
    position_steps = std::ranges::find(motors, config_[motor].name, &bushd::api::MotorState::name)
                         ->position_steps;
  }
  return programs_.next(position_steps, number);
}

}  // namespace bushfaults
