// Which motors a homing is of, and whether they may be homed as is asked.
#include <fmt/format.h>

#include <algorithm>

#include "daemon/services/homing_queue.h"
#include "words/remedy.h"

namespace bushd::daemon {
namespace {

constexpr std::uint32_t kMoreSlowSteps = 1000;  // than a ramp has

}  // namespace

Result<std::vector<MotorId>> HomingQueue::motors_of(const api::Home& request) const {
  if (request.all && !request.motors.empty()) {
    return fail("all motors are to be homed, and some are named; name them, or home all");
  }
  auto motors = request.all ? all_by_order() : installation_.find(request.motors);
  if (!motors) return motors;
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  for (const MotorId motor : *motors) {
    if (const auto may = may_home(motor); !may) {
      return fail(installation_[motor].name() + ": " + may.error().text());
    }
    const auto shortest_delay = shortest_delay_of(motor, request.speed);
    if (!shortest_delay) return fail(shortest_delay.error());
    if (const auto may = may_home_by(motor, *shortest_delay); !may) {
      return fail(installation_[motor].name() + ": " + may.error().text());
    }
  }
  return motors;
}

Result<std::vector<MotorId>> HomingQueue::all_by_order() const {
  std::vector<MotorId> motors;
  const config::Config& config = installation_.config();
  for (const MotorId motor : installation_.motors()) {
    if (config[motor].home) motors.push_back(motor);
  }
  std::ranges::stable_sort(motors, {}, [&](MotorId motor) { return config[motor].home->order; });
  if (!motors.empty()) return motors;
  return fail("no motor has a home switch; add 'home = {...}' to those that have one");
}

Result<void> HomingQueue::may_home(MotorId id) const {
  const Mcu& mcu = installation_.mcu_of(id);
  if (!installation_.config()[id].home) {
    return fail("no home switch configured: add 'home = {...}' to motor \"" +
                installation_[id].name() + "\"");
  }
  if (auto may = interlocks_.may_home(id); !may) return may;
  if (installation_[id].has_plan()) {
    return fail("it moves; run " + words::remedy("stop", installation_[id].name()) + " first");
  }
  if (!mcu.can_home()) {
    return fail("MCU " + mcu.name() + " cannot home; find out where it stands and run " +
                words::set_remedy(installation_[id].name()));
  }
  const bushd_home message = message_for({.motor = id, .shortest_delay = 0});
  return installation_[id].reach().may_be_moved_within(std::int64_t{message.most_steps} +
                                                       message.slow_steps);
}

// An MCU without slow runs is told no longer delays than 16 bits hold.
Result<void> HomingQueue::may_home_by(MotorId id, bushd_delay shortest_delay) const {
  const Mcu& mcu = installation_.mcu_of(id);
  if (mcu.can_run_slowly()) return {};
  const bushd_home message = message_for({.motor = id, .shortest_delay = shortest_delay});
  if (bushd_delay_is_code(message.shortest_delay) && bushd_delay_is_code(message.slow_delay))
    return {};
  const double slowest_ns =
      std::min(static_cast<double>(installation_.table_of(id)->view().time_unit_ns),
               static_cast<double>(BUSHD_HOME_UNIT_NS)) *
      UINT16_MAX;
  return fail(fmt::format(
      "MCU {} cannot home it so slowly; ask for {:.6g} steps/s or more (--speed --steps, or speed "
      "of its home)",
      mcu.name(), 1e9 / slowest_ns));
}

Result<bushd_delay> HomingQueue::shortest_delay_of(MotorId id,
                                                   const std::optional<api::Speed>& speed) const {
  const auto& home = installation_.config()[id].home;
  std::optional<api::Speed> asked = speed;
  if (!asked && home && home->speed) asked = api::Speed{.per_s = *home->speed};
  auto shortest_delay = installation_[id].reach().shortest_delay_at(asked);
  if (!shortest_delay)
    return fail(installation_[id].name() + ": " + shortest_delay.error().message);
  return shortest_delay;
}

bushd_home HomingQueue::message_for(const Task& task) const {
  const MotorId id = task.motor;
  const config::Motor& motor = installation_.config()[id];
  const config::Home& home = *motor.home;
  const bushd_table& table = installation_.table_of(id)->view();
  const std::uint64_t first =
      std::max<std::uint64_t>({table.accel.code[0], table.decel.code[0], task.shortest_delay});
  const std::uint64_t slow_ns = std::max<std::uint64_t>(
      {first * table.time_unit_ns, installation_.config().bus_of(motor).tick_ns(),
       1'000'000'000u / home.slow_steps_per_s});
  const std::uint64_t units = (slow_ns + BUSHD_HOME_UNIT_NS - 1) / BUSHD_HOME_UNIT_NS;
  return {.motor = motor.output.value,
          .direction = static_cast<std::int8_t>(home.positive ? 1 : -1),
          .most_steps = home.most_steps,
          .shortest_delay = task.shortest_delay,
          .slow_steps = home.slow_most_steps.value_or(table.decel.count + kMoreSlowSteps),
          .slow_delay = units,
          .position_steps = home.position_steps};
}

}  // namespace bushd::daemon
