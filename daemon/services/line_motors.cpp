#include "daemon/services/line_motors.h"

#include <fmt/format.h>

#include <algorithm>

#include "api/request.h"

namespace bushd::daemon {
namespace {

Result<void> few_enough(std::size_t motors) {
  if (motors <= api::MoveLine::kMotors.most) return {};
  return fail(fmt::format("{} motors are named; a line has at most {}", motors,
                          api::MoveLine::kMotors.most));
}

}  // namespace

Result<void> may_be_one_line(const Installation& installation, const std::vector<MotorId>& motors) {
  const auto keeps_pace = [&](MotorId motor) {
    return installation.mcu_of(motor).offers.paced_lines != nullptr;
  };
  const auto at_port = std::ranges::find_if(motors, keeps_pace);
  if (at_port == motors.end()) return on_one_bus(installation, motors);
  if (auto few = few_enough(motors.size()); !few) return few;
  const auto not_at_port = std::ranges::find_if_not(motors, keeps_pace);
  if (not_at_port != motors.end()) {
    return fail(fmt::format(
        "{} is at a serial port that makes pulses, and {} is connected to {}: their steps have no "
        "common time. Move them without --line, or connect both to such ports or both to one bus",
        installation[*at_port].name(), installation[*not_at_port].name(),
        installation.mcu_of(*not_at_port).name()));
  }
  for (const MotorId motor : motors) {
    const config::Bus& first = installation.bus_of(installation.mcu_of(motors.front())).config;
    const config::Bus& bus = installation.bus_of(installation.mcu_of(motor)).config;
    if (bus.tick_us == first.tick_us) continue;
    return fail(fmt::format(
        "bus {} has tick_us = {} and bus {} tick_us = {}: ports of a line go by the same ticks. "
        "Give both the same tick_us, or move them without --line",
        first.name, first.tick_us, bus.name, bus.tick_us));
  }
  return {};
}

Result<void> on_one_bus(const Installation& installation, const std::vector<MotorId>& motors) {
  if (auto few = few_enough(motors.size()); !few) return few;
  const auto bus_name = [&](MotorId motor) {
    return installation.bus_of(installation.mcu_of(motor)).config.name;
  };
  for (const MotorId motor : motors) {
    if (installation.mcu_of(motor).offers.streams) continue;
    const bool lines = installation.mcu_of(motor).offers.paced_lines != nullptr;
    return fail(fmt::format("{} is on bus {}, which makes runs of tables {}; move it {}",
                            installation[motor].name(), bus_name(motor),
                            lines ? "and lines, but no paths" : "only, no lines or paths",
                            lines ? "from point to point, by 'move --line'" : "without --line"));
  }
  for (const MotorId motor : motors) {
    if (bus_name(motor) == bus_name(motors.front())) continue;
    return fail(fmt::format(
        "{} is on bus {} and {} on bus {}: ticks of two buses are not in step, so motors of a line "
        "must be on one. Move them without --line, or connect their MCUs to one bus",
        installation[motors.front()].name(), bus_name(motors.front()), installation[motor].name(),
        bus_name(motor)));
  }
  return {};
}

Result<void> may_be_elementary(const Installation& installation,
                               const std::vector<MotorId>& motors) {
  const Mcu& mcu = installation.mcu_of(motors.front());
  const auto elsewhere = std::ranges::find_if(
      motors, [&](MotorId motor) { return installation.mcu_of(motor).id != mcu.id; });
  if (elsewhere != motors.end()) {
    return fail(fmt::format(
        "{} is connected to MCU {} and {} to {}: by the elementary law one MCU makes each step of "
        "the line; name motors of one MCU, or ask for the leading law",
        installation[motors.front()].name(), mcu.name(), installation[*elsewhere].name(),
        installation.mcu_of(*elsewhere).name()));
  }
  if (mcu.makes_elementary_lines()) return {};
  return fail(
      fmt::format("MCU {} makes no lines by the elementary law by itself: its firmware does not, "
                  "or the bus has "
                  "frames = \"ticks\"; ask for the leading law",
                  mcu.name()));
}

}  // namespace bushd::daemon
