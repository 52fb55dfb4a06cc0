#include "clients.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>

#include "times.h"

namespace bushfaults {
namespace {

constexpr std::int64_t kLongestMove = 6000;
constexpr std::uint32_t kClientsStream = 100;  // of randomness
constexpr std::uint32_t kShutterStream = 421;
constexpr std::uint32_t kLawStream = 422;
using bushd::sim::TimeNs;

bool begins_motion(CommandKind kind) {
  switch (kind) {
    case CommandKind::kMove:
    case CommandKind::kGroupMove:
    case CommandKind::kRetarget:
    case CommandKind::kHome:
    case CommandKind::kArm:
    case CommandKind::kUserMove:
    case CommandKind::kSpeed:
    case CommandKind::kLegMove:
    case CommandKind::kJog:
    case CommandKind::kLine:
    case CommandKind::kPath:
    case CommandKind::kTrajectory:
    case CommandKind::kArmLine:
    case CommandKind::kMcuProgram:
      return true;
    default:
      return false;
  }
}

}  // namespace

Clients::Clients(const bushd::config::Config& config, const Witness& witness,
                 const CommandRates& rates, std::uint64_t seed)
    : config_(config),
      witness_(witness),
      rates_(rates),
      per_hour_(std::accumulate(rates.begin(), rates.end(), 0.0)),
      random_(seed, kClientsStream),
      joggers_(seed),
      programs_(config, seed),
      mcu_programs_(config, seed),
      random_of_shutter_(seed, kShutterStream),
      random_of_laws_(seed, kLawStream) {
  if (const auto motor = ShutterPlace::motor(config)) shutter_ = config[*motor].name;
}

bushd::sim::TimeNs Clients::next_after(bushd::sim::TimeNs now_ns) {
  return per_hour_ > 0 ? now_ns + random_.wait(3.6e12 / per_hour_) : bushd::sim::kNever;
}

Request Clients::make(Ask ask) {
  return {.client = "c" + std::to_string(random_.below(kClients)), .ask = ask};
}

Request Clients::of_all_online(Ask ask) {
  Request request = make(ask);
  const auto offline = [](const auto& state) {
    return !state || state->state == bushd::api::McuState::kOffline;
  };
  if (std::ranges::none_of(witness_.states(), offline)) return request;
  for (const auto& state : witness_.states()) {
    if (!offline(state) && !state->motors.empty()) request.add(state->motors.front().name, 0);
  }
  return request;
}

std::string Clients::any_motor() {
  return config_.motors[static_cast<std::size_t>(random_.below(config_.motors.size()))].name;
}

std::vector<Clients::Choice> Clients::motors_that(bool moving, bool uncertain) const {
  std::vector<Choice> found;
  for (const auto& state : witness_.states()) {
    if (!state) continue;
    for (const bushd::api::MotorState& motor : state->motors) {
      // Its program would seldom find it where it left it.
      if (shutter_ == motor.name && !random_of_shutter_.one_in(8)) continue;
      const bool waits = motor.activity == bushd::api::Activity::kArming ||
                         motor.activity == bushd::api::Activity::kArmed;
      if (!waits && motor.moving == moving &&
          (motor.trust == bushd::api::Trust::kUncertain) == uncertain) {
        found.push_back({motor.name, motor.position_steps, motor.target_steps});
      }
    }
  }
  return found;
}

Request Clients::move(std::size_t wanted) {
  const bool absolute = random_.one_in(3);
  Request request = make(absolute ? Ask::kMoveTo : Ask::kMoveBy);
  std::vector<Choice> free = motors_that(false, false);
  // Now and then one that may be moving: a new target, or a race.
  if (free.empty() || random_.one_in(20)) {
    request.add(any_motor(), random_.between(-100, 100));
    return request;
  }
  for (; wanted > 0 && !free.empty(); --wanted) {
    const auto index = static_cast<std::size_t>(random_.below(free.size()));
    const Choice motor = free[index];
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(index));
    std::int64_t steps = random_.magnitude(1, kLongestMove) * (random_.one_in(2) ? 1 : -1);
    if (motor.position_steps + steps > kFarthestSteps) steps = -std::abs(steps);
    if (motor.position_steps + steps < -kFarthestSteps) steps = std::abs(steps);
    if (random_.one_in(50)) steps = 0;
    request.add(motor.name, absolute ? motor.position_steps + steps : steps);
  }
  return request;
}

// A new target for some that move: around their old one, or around where they are, so that it is
// ahead, near or behind. Sometimes one at rest joins them.
Request Clients::retarget() {
  const bool absolute = !random_.one_in(3);
  Request request = make(absolute ? Ask::kMoveTo : Ask::kMoveBy);
  std::vector<Choice> some = motors_that(true, false);
  if (some.empty()) return move(1);
  const auto at_rest = motors_that(false, false);
  if (!at_rest.empty() && random_.one_in(4)) some.push_back(random_.pick(at_rest));
  for (std::int64_t n = random_.magnitude(1, 8); n > 0 && !some.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(some.size()));
    const Choice motor = some[index];
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(index));
    const std::int64_t base = random_.one_in(2) ? motor.position_steps : motor.target_steps;
    const std::int64_t away = random_.magnitude(1, kLongestMove) * (random_.one_in(2) ? 1 : -1);
    const std::int64_t target = std::clamp(base + away, -kFarthestSteps, kFarthestSteps);
    request.add(motor.name, absolute ? target : target - motor.target_steps);
  }
  return request;
}

Request Clients::stop() {
  if (random_.one_in(6)) return stop_all();
  Request request = make(Ask::kStop);
  std::vector<Choice> moving = motors_that(true, false);
  if (moving.empty()) {
    request.add(any_motor(), 0);
    return request;
  }
  for (std::int64_t n = random_.magnitude(1, 8); n > 0 && !moving.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(moving.size()));
    request.add(moving[index].name, 0);
    moving.erase(moving.begin() + static_cast<std::ptrdiff_t>(index));
  }
  return request;
}

Request Clients::set(const std::vector<Choice>& motors) {
  Request request = make(Ask::kSetPosition);
  for (const Choice& motor : motors) {
    request.add(motor.name, random_.between(-kFarthestSteps / 2, kFarthestSteps / 2));
    if (request.motors.size() == 16) break;
  }
  return request;
}

Request Clients::nonsense() {
  constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max();
  constexpr Ask kNamesMotors[] = {Ask::kMoveBy, Ask::kMoveTo, Ask::kSetPosition, Ask::kHome,
                                  Ask::kArm};
  Request request = make(kNamesMotors[random_.below(std::size(kNamesMotors))]);
  switch (random_.below(7)) {
    case 0:
      break;
    case 1:
      request.add("no such motor", 1);
      break;
    case 2:
      request = move(1);
      request.damage = static_cast<Damage>(random_.between(1, 4));
      break;
    case 3:
      request.ask = Ask::kMoveBy;
      request.add(any_motor(), random_.one_in(2) ? kHuge : -kHuge);
      break;
    case 4:
      request.ask = random_.one_in(2) ? Ask::kMoveTo : Ask::kSetPosition;
      request.add(any_motor(), random_.one_in(2) ? kHuge : -kHuge - 1);
      break;
    case 5:
      request.add(any_motor(), 5);
      request.add(request.motors.front(), 5);
      break;
    default:
      request.add(any_motor(), 5);
      request.client = random_.one_in(2) ? "" : std::string(200, 'x');
      break;
  }
  return request;
}

Request Clients::switch_drivers() {
  Request request = make(random_.one_in(2) ? Ask::kEnable : Ask::kDisable);
  if (!random_.one_in(3)) request.add(any_motor(), 0);
  return request;
}

Request Clients::home() {
  Request request = make(Ask::kHome);
  for (std::int64_t n = random_.between(1, 4); n > 0; --n) {
    const auto index = static_cast<std::size_t>(random_.below(config_.motors.size()));
    const bushd::config::Motor& motor = config_.motors[index];
    const bool named = std::ranges::find(request.motors, motor.name) != request.motors.end();
    // Now and then one that has no switch.
    if (!named && (motor.home || random_.one_in(20))) request.add(motor.name, 0);
  }
  if (request.motors.empty()) request.add(config_.motors.front().name, 0);
  return request;
}

Request Clients::arm() {
  Request request = make(Ask::kArm);
  request.rising = random_.one_in(2);
  request.delay_us = static_cast<std::int32_t>(random_.magnitude(50, 1'500'000));
  std::vector<Choice> free = motors_that(false, false);
  for (std::int64_t n = random_.between(1, 8); n > 0 && !free.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(free.size()));
    std::int64_t steps = random_.magnitude(1, kLongestMove) * (random_.one_in(2) ? 1 : -1);
    if (std::abs(free[index].position_steps + steps) > kFarthestSteps) steps = -steps;
    request.add(free[index].name, steps);
    free.erase(free.begin() + static_cast<std::ptrdiff_t>(index));
  }
  if (request.motors.empty()) request.add(any_motor(), 1);
  return request;
}

Request Clients::disarm() {
  Request request = make(Ask::kDisarm);
  if (!random_.one_in(3)) request.add(any_motor(), 0);
  return request;
}

// Those that are uncertain, or any: people are not always right.
Request Clients::confirm() {
  Request request = make(Ask::kConfirm);
  std::vector<Choice> some = motors_that(false, !random_.one_in(4));
  for (std::int64_t n = random_.between(1, 4); n > 0 && !some.empty(); --n) {
    const auto index = static_cast<std::size_t>(random_.below(some.size()));
    request.add(some[index].name, 0);
    some.erase(some.begin() + static_cast<std::ptrdiff_t>(index));
  }
  if (request.motors.empty()) request.add(any_motor(), 0);
  return request;
}

std::size_t Clients::index_of(const std::string& motor) const {
  const auto found = std::ranges::find(config_.motors, motor, &bushd::config::Motor::name);
  return static_cast<std::size_t>(found - config_.motors.begin());
}

Request Clients::move_or_retarget() {
  if (random_.one_in(2)) return retarget();
  return move(static_cast<std::size_t>(random_.between(1, 4)));
}

// Whether an MCU that is there says so; the detail of others says what will be.
bool Clients::says(const char* detail) const {
  return std::any_of(witness_.states().begin(), witness_.states().end(), [&](const auto& state) {
    return state && state->state != bushd::api::McuState::kOffline &&
           state->detail.find(detail) != std::string::npos;
  });
}

std::optional<Request> Clients::remedy() {
  if (!random_.one_in(3)) return std::nullopt;
  if (emergency()) return clear_all();
  if (says("drivers disabled")) return enable_all();
  const std::vector<Choice> uncertain = motors_that(false, true);
  if (!uncertain.empty()) return set(uncertain);
  return remedy_of_pauses();
}

Request Clients::compose(CommandKind kind) {
  switch (kind) {
    case CommandKind::kMove:
      return move(1);
    case CommandKind::kGroupMove:
      return move(static_cast<std::size_t>(random_.one_in(4) ? random_.between(7, 32)
                                                             : random_.between(2, 6)));
    case CommandKind::kRetarget:
      return retarget();
    case CommandKind::kStop:
      return stop();
    case CommandKind::kEmergencyStop:
      return make(Ask::kEmergencyStop);
    case CommandKind::kSetPosition: {
      std::vector<Choice> some = motors_that(false, false);
      if (some.size() > 2) some.resize(2);
      return set(some);
    }
    case CommandKind::kSwitch:
      return switch_drivers();
    case CommandKind::kClear:
      return clear_all();
    case CommandKind::kAgain:
    case CommandKind::kNonsense:
      return nonsense();
    case CommandKind::kHome:
      return home();
    case CommandKind::kArm:
      return arm();
    case CommandKind::kDisarm:
      return disarm();
    case CommandKind::kConfirm:
      return confirm();
    case CommandKind::kUserMove:
      return move_of_user();
    case CommandKind::kUserSet:
      return set_of_user();
    case CommandKind::kSpeed:
      return move_at_speed();
    case CommandKind::kLegMove:
      return move_with_legs();
    case CommandKind::kJog:
      return jog();
    case CommandKind::kMotorPause:
      return pause_or_hold();
    case CommandKind::kSettings:
      return change_settings();
    case CommandKind::kLine:
      return move_along_line();
    case CommandKind::kArmLine:
      return arm_line();
    case CommandKind::kPath:
      return move_along_path();
    case CommandKind::kTrajectory:
      return tell_trajectory();
    case CommandKind::kCamac:
      return of_program();
    case CommandKind::kChased:
      return chased();
    case CommandKind::kMcuProgram:
      return mcu_programs_.next();
    case CommandKind::kShutter:
      return programs_.next_of_shutter(
          witness_.positions().plant_steps(ShutterPlace::motor(config_)->value),
          witness_.shutter().any_open());
  }
  return nonsense();
}

CommandKind Clients::choose() {
  double chance = random_.unit() * per_hour_;
  std::size_t kind = 0;
  while (kind + 1 < kCommandKinds && chance >= rates_[kind]) chance -= rates_[kind++];
  return static_cast<CommandKind>(kind);
}

std::optional<Request> Clients::next() {
  if (auto request = remedy()) return *request;
  const CommandKind chosen = choose();
  ++sent_by_kind_[static_cast<std::size_t>(chosen)];
  if (chosen == CommandKind::kAgain) return std::nullopt;
  return compose(chosen);
}

// A stop at every phase of what it stops: before it is taken, planned or begun, in ramps, at speed,
// and while it settles.
Request Clients::chased() {
  constexpr TimeNs kLatestNs = 4 * kSecond;
  std::optional<Request> motion;
  for (int tries = 0; tries < 20 && !motion; ++tries) {
    const CommandKind kind = choose();
    if (begins_motion(kind)) motion = compose(kind);
  }
  if (!motion) motion = move(1);
  Request end = make(Ask::kStop);
  const auto which = random_.below(10);
  if (which == 0) end.ask = Ask::kEmergencyStop;
  if (which == 1 || which == 2) end.ask = Ask::kPause;
  if (which == 3) end.ask = Ask::kHold;
  if (end.ask != Ask::kEmergencyStop && !random_.one_in(4)) {
    for (const std::string& name : motion->motors) {
      if (!end.names(name)) end.add(name, 0);
    }
  }
  if (random_.one_in(2)) end.client = motion->client;
  const TimeNs after_ns = random_.one_in(2) ? 0 : random_.magnitude(kMs, kLatestNs);
  later_.push_back({.after_ns = after_ns, .due_ns = 0, .request = std::move(end)});
  return *motion;
}

Request Clients::one_of_flood(std::size_t client) {
  Request request = compose(choose());
  request.client = "f" + std::to_string(client);
  return request;
}

}  // namespace bushfaults
