// Commands that are neither answered at once nor moves: they wait until MCUs report what was asked
// for.
#include <algorithm>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"

namespace bushd::daemon {
namespace {

constexpr std::int64_t kPendingUs = 5'000'000;  // a ramp-down from full speed, with room

}  // namespace

void Core::start_pending(std::int64_t now_us, const command_t& command) {
  Pending pending{.client = {command.client_id, command.number},
                  .kind = command.kind,
                  .motors = motors_named(command),
                  .steps = command.steps,
                  .mcus = {},
                  .deadline_us = now_us + kPendingUs};
  answer(pending.client, reply_t::ACCEPTED, "", "accepted");
  if (command.kind == command_t::STOP) {
    std::erase_if(pending.motors,
                  [this](std::size_t m) { return !motors_[m].axis.busy() && !is_homing(m); });
    stop_motors(now_us, pending.motors);
  } else if (command.kind == command_t::DISARM) {
    std::erase_if(pending.motors, [this](std::size_t m) { return !motors_[m].armed; });
    disarm(pending.motors);
  } else if (command.kind == command_t::EMERGENCY_STOP) {
    emergency_stop(pending);
  } else {
    pending.mcus = mcus_of(pending.motors);
    for (const std::size_t m : pending.mcus) {
      const Mcu& mcu = mcus_[m];
      if (command.kind == command_t::ENABLE)
        master_of(mcu).control(mcu.in_bus, BUSHD_CONTROL_ENABLE);
      if (command.kind == command_t::DISABLE)
        master_of(mcu).control(mcu.in_bus, BUSHD_CONTROL_DISABLE);
      if (command.kind == command_t::CLEAR_FAULTS) {
        master_of(mcu).control(mcu.in_bus, BUSHD_CONTROL_CLEAR_FAULTS);
      }
    }
    if (command.kind == command_t::REFERENCE) set_reference(command);
    if (command.kind == command_t::SET_POSITION) {
      for (std::size_t i = 0; i < pending.motors.size(); ++i) {
        const Motor& motor = motors_[pending.motors[i]];
        const Mcu& mcu = mcus_[motor.mcu];
        master_of(mcu).set_position(mcu.in_bus, motor.config->output.value,
                                    static_cast<std::int32_t>(command.steps[i]));
      }
    }
  }
  pending_.push_back(std::move(pending));
}

void Core::emergency_stop(Pending& pending) {
  outputs_.log(LogLevel::kWarning, "emergency stop, commanded by " + pending.client.id);
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    buses_[b]->master.emergency_stop(config_.buses[b].emergency_stop);
  }
  for (std::size_t motor = 0; motor < motors_.size(); ++motor) forget_waiting_homing(motor);
  pending.motors.clear();
  std::string unknown;
  for (std::size_t m = 0; m < mcus_.size(); ++m) {
    if (view_of(mcus_[m]).phase == link::McuPhase::kOnline) {
      pending.mcus.push_back(m);
    } else {
      unknown += " " + mcus_[m].config->id;
    }
  }
  if (!unknown.empty())
    pending.done = "done; not online, so it is unknown whether they stand:" + unknown;
}

bool Core::stopping_all() const {
  return std::any_of(pending_.begin(), pending_.end(), [](const Pending& pending) {
    return pending.kind == command_t::EMERGENCY_STOP;
  });
}

std::string Core::follow_emergency_stop(Pending& pending, std::int64_t now_us) const {
  std::string failure;
  std::erase_if(pending.mcus, [&](std::size_t m) {
    const link::McuView& view = view_of(mcus_[m]);
    if (view.phase == link::McuPhase::kOffline) {
      pending.done = "done; MCU " + mcus_[m].config->id + " was lost meanwhile: " + view.detail;
      return true;
    }
    const bool latched = (view.report.faults & BUSHD_FAULT_EMERGENCY) != 0;
    // A ramp-down by a long table may take its time.
    if (!latched && now_us > pending.deadline_us) {
      failure = "MCU " + mcus_[m].config->id + " did not confirm it in time";
    }
    return latched && view.report.moving == 0;
  });
  return failure;
}

// What the report of an MCU shows against a command being done there; "" for nothing.
std::string Core::still_wrong(const Pending& pending, const Mcu& mcu) const {
  const bushd_report& report = view_of(mcu).report;
  const bool enabled = (report.flags & BUSHD_FLAG_ENABLED) != 0;
  if (pending.kind == command_t::ENABLE && !enabled) return "did not enable its drivers";
  if (pending.kind == command_t::DISABLE && enabled) return "did not disable its drivers";
  if (pending.kind == command_t::CLEAR_FAULTS && report.faults != 0) {
    return "still has a fault: " + fault_text(report);
  }
  if (pending.kind == command_t::SET_POSITION) {
    for (std::size_t i = 0; i < pending.motors.size(); ++i) {
      const Motor& motor = motors_[pending.motors[i]];
      if (&mcus_[motor.mcu] == &mcu && motor.position_steps != pending.steps[i]) {
        return "did not take the position of " + motor.config->name;
      }
    }
  }
  return {};
}

void Core::check_pending(std::int64_t now_us, std::optional<std::size_t> reported) {
  for (auto it = pending_.begin(); it != pending_.end();) {
    Pending& pending = *it;
    std::string failure;
    if (pending.kind == command_t::STOP) {
      std::erase_if(pending.motors,
                    [this](std::size_t m) { return !motors_[m].axis.busy() && !is_homing(m); });
    } else if (pending.kind == command_t::DISARM) {
      std::erase_if(pending.motors, [this, &pending](std::size_t m) {
        if (motors_[m].armed) return false;
        if (motors_[m].axis.busy()) {
          pending.done =
              motors_[m].config->name + " moves: the trigger came before it was disarmed";
        }
        return true;
      });
    } else if (pending.kind == command_t::EMERGENCY_STOP) {
      failure = follow_emergency_stop(pending, now_us);
    } else if (reported && !master_of(mcus_[*reported]).busy(mcus_[*reported].in_bus)) {
      const auto found = std::find(pending.mcus.begin(), pending.mcus.end(), *reported);
      if (found != pending.mcus.end()) {
        failure = still_wrong(pending, mcus_[*reported]);
        if (!failure.empty()) failure = "MCU " + mcus_[*reported].config->id + " " + failure;
        pending.mcus.erase(found);
      }
    }
    const bool stop = pending.kind == command_t::STOP || pending.kind == command_t::DISARM;
    const bool done = stop ? pending.motors.empty() : pending.mcus.empty();
    // A motor that runs down a long table may take its time: the deadline is for MCUs that do not
    // answer.
    const bool timed = !stop && pending.kind != command_t::EMERGENCY_STOP;
    if (!done && failure.empty() && timed && now_us > pending.deadline_us) {
      failure = "MCU " + mcus_[pending.mcus.front()].config->id + " did not confirm it in time";
    }
    if (!done && failure.empty()) {
      ++it;
      continue;
    }
    const Pending finished = std::move(pending);
    it = pending_.erase(it);
    finish_pending(finished, failure);
  }
}

void Core::finish_pending(const Pending& pending, const std::string& failure) {
  if (failure.empty() && pending.kind == command_t::SET_POSITION) {
    for (std::size_t i = 0; i < pending.motors.size(); ++i) {
      Motor& motor = motors_[pending.motors[i]];
      motor.doubt.clear();
      log_set(motor);
    }
  }
  changed_ = true;
  const bool good = failure.empty();
  answer(pending.client, reply_t::RESULT, good ? "done" : "fault", good ? pending.done : failure);
}

}  // namespace bushd::daemon
