// The state as clients see it: one message per MCU.
#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"

namespace bushd::daemon {
namespace {

const char* state_word(const link::McuView& view) {
  if (view.phase == link::McuPhase::kOffline) return "OFFLINE";
  if (view.phase == link::McuPhase::kConnecting) return "BUSY";
  switch (view.report.state) {
    case BUSHD_STATE_READY:
      return "READY";
    case BUSHD_STATE_RUN:
      return "RUN";
    case BUSHD_STATE_FAULT:
      return "FAULT";
    default:
      return "BUSY";
  }
}

std::string detail_of(const link::McuView& view, bool two_masters) {
  if (view.phase != link::McuPhase::kOnline) return view.detail;
  if (view.report.faults != 0) return fault_text(view.report);
  if (two_masters) return "another master talks on the line";
  if ((view.report.flags & BUSHD_FLAG_ENABLED) == 0) return "drivers disabled";
  return {};
}

}  // namespace

table_ref_t Core::ref_to(const tables::Table& table) {
  table_ref_t ref{};
  ref.name = table.name();
  ref.revision = static_cast<std::int32_t>(table.revision());
  ref.hash = table.short_hash();
  return ref;
}

const char* Core::activity_of(std::size_t motor) const {
  if (motors_[motor].axis.busy()) return "move";
  if (is_homing(motor)) return "home";
  return is_moved_locally(motor) ? "local" : "rest";
}

state_t Core::state_of(const Mcu& mcu) const {
  const link::McuView& view = view_of(mcu);
  state_t state;
  state.bus = config_.buses[mcu.bus].name;
  state.mcu = mcu.config->id;
  state.address = mcu.config->address.value;
  state.mcu_state = state_word(view);
  state.detail = detail_of(view, buses_[mcu.bus]->two_masters);
  if (view.reported) state.inputs = system_inputs_words(view.report.system_inputs);
  state.boot_number = view.identified ? view.identity.boot_number : 0;
  state.tick = view.tick;
  state.rejected_commands = static_cast<std::int64_t>(rejected_commands_);
  for (unsigned output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
    if (mcu.motor_of[output] < 0) continue;
    const auto index = static_cast<std::size_t>(mcu.motor_of[output]);
    const Motor& motor = motors_[index];
    motor_state_t entry;
    entry.name = motor.config->name;
    entry.group = config_.group_of(*motor.config).name;
    entry.table = ref_to(table_of(*motor.config));
    entry.output = static_cast<std::int16_t>(output);
    entry.position_steps = motor.position_steps;
    entry.target_steps = motor.axis.busy() ? motor.axis.final_steps() : motor.position_steps;
    entry.armed = motor.armed.has_value();
    entry.moving = is_moving(index) && !entry.armed;
    entry.activity = entry.armed ? "rest" : activity_of(index);
    entry.velocity_steps_per_s = entry.moving ? motor.axis.velocity_steps_per_s() : 0.0;
    entry.enabled = view.reported && (view.report.flags & BUSHD_FLAG_ENABLED) != 0;
    entry.input = view.reported && (view.report.inputs >> output & 1) != 0;
    if (view.reported) entry.forbidden = forbidden_word(view.report, output);
    entry.trust = motor.doubt.empty() ? "known" : "uncertain";
    state.motors.push_back(std::move(entry));
  }
  state.motor_count = static_cast<std::int32_t>(state.motors.size());
  return state;
}

void Core::publish() {
  ++sequence_;
  const std::int64_t now = outputs_.wall_clock_us();
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    state_t state = state_of(mcus_[i]);
    state.utime_us = now;
    state.sequence = sequence_;
    state.part = static_cast<std::int32_t>(i);
    state.parts = static_cast<std::int32_t>(mcus_.size());
    outputs_.state(state);
  }
}

}  // namespace bushd::daemon
