// Motion that MCUs make by themselves, homing and local inputs: no move has led to where these
// motors stand, so the log of moves tells when they went, and where to.
#include <nlohmann/json.hpp>

#include "daemon/bus.h"
#include "daemon/core.h"

namespace bushd::daemon {

void Core::notice_alone(std::size_t index, const Mcu& mcu, const bushd_report& report) {
  Motor& motor = motors_[index];
  const std::uint8_t output = motor.config->output.value;
  const bool autonomous = (report.autonomous >> output & 1) != 0;
  // Somebody has tapped a button between two reports.
  const bool tapped = motor.config->local && !motor.axis.busy() && !being_set(index) &&
                      report.motor[output].position_steps != motor.position_steps;
  if (motor.alone || (!autonomous && !tapped)) return;
  motor.alone = Motor::Alone{
      .since = mcu.told, .from_steps = motor.position_steps, .homes = is_homing(index)};
}

void Core::end_alone(std::size_t index, const link::McuView& view) {
  Motor& motor = motors_[index];
  const bool autonomous = (view.report.autonomous >> motor.config->output.value & 1) != 0;
  if (!motor.alone || autonomous) return;
  const Motor::Alone alone = *std::exchange(motor.alone, std::nullopt);
  const config::Bus& bus = config_.buses[motor.bus];
  const bool homed = alone.homes && view.report.homing == BUSHD_HOMING_DONE;
  nlohmann::json line = {{"event", "alone"},
                         {"motor", motor.config->name},
                         {"bus", bus.name},
                         {"address", mcus_[motor.mcu].config->address.value},
                         {"output", motor.config->output.value},
                         {"tick_ns", bus.tick_ns()},
                         {"what", alone.homes ? "homing" : "local"},
                         {"until_tick", view.tick},
                         {"from_steps", alone.from_steps},
                         {"set", homed || alone.set},
                         {"position_steps", motor.position_steps}};
  if (alone.since) line["from_tick"] = *alone.since;
  outputs_.move_log(line.dump());
}

}  // namespace bushd::daemon
