#include "positions.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

namespace bushfaults {
namespace {

// Ten requests in a row without an answer put an MCU offline. Each is awaited for 40 ms at most
// beyond its bytes, and they follow each other in 50 ms at most: less than 1 s. Bytes that came
// late are no answers, but the reports in them are read: 60 ms for each of the delays.
constexpr bushd::sim::TimeNs kMaxAgeNs = 1'500'000'000;
// Reports kept per MCU: polls come every 10 ms at most, and a state may be as old as the longest
// pause and kMaxAgeNs together.
constexpr std::size_t kReportsKept = 1024;

bool is_online(const bushd::api::StateSnapshot& state) {
  using bushd::api::McuState;
  if (state.state == McuState::kOffline) return false;
  // Not ready for moves, but no longer connecting.
  return state.state != McuState::kBusy || state.detail == "drivers disabled";
}

}  // namespace

bool is_good(bushd::api::Trust trust) {
  return trust == bushd::api::Trust::kKnown || trust == bushd::api::Trust::kRestored;
}

Positions::Positions(const bushd::config::Config& config, const bushd::sim::Bus& bus,
                     const bushd::sim::Plant& plant)
    : config_(config),
      bus_(bus),
      plant_(plant),
      motors_(config.motors.size()),
      reports_(config.mcus.size()),
      boot_seen_(config.mcus.size()) {}

std::int64_t Positions::plant_steps(std::size_t motor) const {
  const bushd::config::Motor& of = config_.motors[motor];
  return plant_.position_steps(of.mcu.value, of.output.value);
}

void Positions::pause(TimeNs now_ns, TimeNs until_ns) {
  const TimeNs from_ns = std::max(paused_until_ns_, now_ns);
  paused_ns_ += std::max(until_ns - from_ns, TimeNs{0});
  paused_until_ns_ = std::max(from_ns, until_ns);
}

Positions::TimeNs Positions::paused_by_ns(TimeNs now_ns) const {
  return paused_ns_ - std::max(paused_until_ns_ - now_ns, TimeNs{0});
}

void Positions::reported(TimeNs now_ns, std::size_t mcu) {
  const bushd::sim::VirtualMcu& of = bus_.mcu(mcu);
  Report report{now_ns, paused_by_ns(now_ns), of.boot_number(), of.core().tick, {}};
  for (const bushd::config::Motor& motor : config_.motors) {
    if (motor.mcu.value != mcu) continue;
    report.pulses[motor.output.value] =
        plant_.position_steps_before(mcu, motor.output.value, of.tick_start_ns());
  }
  auto& reports = reports_[mcu];
  if (reports.size() == kReportsKept) reports.pop_front();
  reports.push_back(report);
}

void Positions::mcu_reset(std::size_t mcu) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    if (config_.motors[i].mcu.value != mcu || kept_) continue;
    const auto home_offset = motors_[i].home_offset;
    motors_[i] = {};
    motors_[i].offset.reset();
    motors_[i].home_offset = home_offset;
  }
}

void Positions::daemon_started() {
  std::fill(boot_seen_.begin(), boot_seen_.end(), std::nullopt);
  if (kept_) return;
  // It cannot know of what the one before has seen.
  for (Motor& motor : motors_) motor.cut_off_ns.reset();
}

void Positions::may_be_set(std::size_t motor, std::int64_t position_steps) {
  motors_[motor].perhaps_homed = false;
  motors_[motor].perhaps_set.push_back({position_steps, plant_steps(motor) - position_steps});
}

void Positions::was_set(std::size_t motor, std::int64_t position_steps) {
  motors_[motor].offset = plant_steps(motor) - position_steps;
  motors_[motor].perhaps_set.clear();
  motors_[motor].perhaps_confirmed = false;
  motors_[motor].cut_off_ns.reset();
}

void Positions::has_switch(std::size_t motor, std::int64_t at_steps) {
  motors_[motor].home_offset = at_steps - config_.motors[motor].home->position_steps;
}

void Positions::homed(std::size_t index, std::int64_t position_steps) {
  Motor& motor = motors_[index];
  const std::int64_t stands = plant_steps(index);
  if (!motor.at_home(stands, position_steps)) return;
  motor.offset = stands - position_steps;
  motor.cut_off_ns.reset();
}

std::optional<std::string> Positions::was_homed(std::size_t index, std::int64_t position_steps) {
  Motor& motor = motors_[index];
  if (!motor.perhaps_homed) return std::nullopt;  // it has been set since
  // Not the offset of before: an MCU that says so may not have set its counter.
  const auto is_home = [&motor] {
    return motor.offset && std::abs(*motor.offset - *motor.home_offset) <= kHomeSteps;
  };
  if (!is_home()) homed(index, position_steps);
  if (is_home()) return std::nullopt;
  return fmt::format("{} is said to be homed at {}, and would be at {} by its switch",
                     config_.motors[index].name, position_steps,
                     plant_steps(index) - *motor.home_offset);
}

void Positions::cut_off(TimeNs now_ns, std::size_t mcu, std::size_t output) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const bushd::config::Motor& motor = config_.motors[i];
    if (motor.mcu.value == mcu && motor.output.value == output) motors_[i].cut_off_ns = now_ns;
  }
}

std::optional<std::string> Positions::check(TimeNs now_ns, std::size_t mcu,
                                            const bushd::api::StateSnapshot& state) {
  if (strict_ && !is_online(state)) return check_offline(state);
  if (!is_online(state) || state.boot != bus_.mcu(mcu).boot_number()) return std::nullopt;
  const auto tick = static_cast<std::uint32_t>(state.tick);
  const auto& reports = reports_[mcu];
  const auto report = std::find_if(reports.rbegin(), reports.rend(), [&](const Report& r) {
    return r.tick == tick && r.boot_number == state.boot;
  });
  if (report == reports.rend()) {
    return fmt::format("{} is said to have reported in tick {}, and has not", state.mcu,
                       state.tick);
  }
  auto wrong = check_age(now_ns, mcu, *report);
  for (const bushd::api::MotorState& claim : state.motors) {
    if (!wrong && is_good(claim.trust)) wrong = check_motor(mcu, claim, *report);
    if (claim.trust == bushd::api::Trust::kUncertain) follow_set(claim, *report);
  }
  boot_seen_[mcu] = state.boot;
  return wrong;
}

std::optional<std::string> Positions::check_offline(const bushd::api::StateSnapshot& state) const {
  for (const bushd::api::MotorState& claim : state.motors) {
    if (!is_good(claim.trust)) continue;
    const auto found = std::ranges::find(config_.motors, claim.name, &bushd::config::Motor::name);
    if (found == config_.motors.end()) return "a state of an unknown motor " + claim.name;
    const auto index = static_cast<std::size_t>(found - config_.motors.begin());
    if (state.boot == 0) {
      return claim.name + " is said to be known, and its MCU has never been heard";
    }
    const auto& offset = motors_[index].offset;
    // Reset while it gets another table: that is heard with its next report.
    if (!offset && state.state == bushd::api::McuState::kBusy) continue;
    if (offset && plant_steps(index) - *offset == claim.position_steps) continue;
    // Set just before it gets another table, and no report has told of it.
    const bool set = std::ranges::any_of(motors_[index].perhaps_set, [&](const Motor::Set& one) {
      return plant_steps(index) - one.offset == claim.position_steps;
    });
    if (set && state.state == bushd::api::McuState::kBusy) continue;
    return fmt::format("{} ({}) is said to be {} to be at {} while {} is {} ({}), and is at {}",
                       claim.name, word(claim.activity), word(claim.trust), claim.position_steps,
                       state.mcu, word(state.state), state.detail,
                       offset ? plant_steps(index) - *offset : plant_steps(index));
  }
  return std::nullopt;
}

std::optional<std::string> Positions::check_age(TimeNs now_ns, std::size_t mcu,
                                                const Report& report) {
  const TimeNs age_ns = now_ns - report.made_ns - (paused_by_ns(now_ns) - report.paused_ns);
  worst_age_ns_ = std::max(worst_age_ns_, age_ns);
  if (age_ns <= kMaxAgeNs) return std::nullopt;
  return fmt::format("{} is said to be online, and its last report was made {} ms ago",
                     config_.mcus[mcu].id, age_ns / 1'000'000);
}

// With an offset that somebody has asked for meanwhile it is the new one.
bool Positions::agrees(Motor& motor, std::int64_t position_steps, std::int64_t pulses) {
  if (pulses - *motor.offset == position_steps) return true;
  const auto& perhaps = motor.perhaps_set;
  const auto set = std::find_if(perhaps.begin(), perhaps.end(), [&](const Motor::Set& s) {
    return pulses - s.offset == position_steps || s.position_steps == position_steps;
  });
  if (set == perhaps.end() && !motor.at_home(pulses, position_steps)) return false;
  motor.offset = pulses - position_steps;
  return true;
}

// A new daemon does not call known what the one before has set, and its client never heard of.
void Positions::follow_set(const bushd::api::MotorState& claim, const Report& report) {
  const auto found = std::ranges::find(config_.motors, claim.name, &bushd::config::Motor::name);
  if (found == config_.motors.end()) return;
  Motor& motor = motors_[static_cast<std::size_t>(found - config_.motors.begin())];
  if (!motor.offset) return;
  static_cast<void>(agrees(motor, claim.position_steps, report.pulses[found->output.value]));
}

std::optional<std::string> Positions::check_motor(std::size_t mcu,
                                                  const bushd::api::MotorState& claim,
                                                  const Report& report) {
  const auto found = std::ranges::find(config_.motors, claim.name, &bushd::config::Motor::name);
  if (found == config_.motors.end()) return "a state of an unknown motor " + claim.name;
  const auto index = static_cast<std::size_t>(found - config_.motors.begin());
  Motor& motor = motors_[index];
  const std::int64_t pulses = report.pulses[found->output.value];
  if (!motor.offset) {
    // A daemon that has met this boot only cannot know that there was one before.
    const bool first = !boot_seen_[mcu] || *boot_seen_[mcu] == bus_.mcu(mcu).boot_number();
    if (!first) return claim.name + " is said to be known although its MCU was reset";
    motor.offset = pulses - claim.position_steps;
    return std::nullopt;
  }
  if (motor.cut_off_ns && report.made_ns > *motor.cut_off_ns) {
    return claim.name + " is said to be known although it was stopped immediately in motion";
  }
  const bool confirmed = std::exchange(motor.perhaps_confirmed, false);
  if (!agrees(motor, claim.position_steps, pulses)) {
    if (confirmed) {
      motor.offset = pulses - claim.position_steps;
      return std::nullopt;
    }
    return fmt::format("{} is said to be {}, at {} in its MCU's tick {}, but stood at {}",
                       claim.name, word(claim.trust), claim.position_steps, report.tick,
                       pulses - *motor.offset);
  }
  const std::int64_t stands = plant_steps(index);
  if (claim.moving || claim.activity != bushd::api::Activity::kResting ||
      stands - *motor.offset == claim.position_steps) {
    return std::nullopt;
  }
  return fmt::format("{} is said to be at rest at {}, but stands at {}", claim.name,
                     claim.position_steps, stands - *motor.offset);
}

}  // namespace bushfaults
