#include "daemon/core/supervisor.h"

#include <string>
#include <utility>
#include <variant>

#include "base/output_bits.h"
#include "base/overloaded.h"
#include "daemon/model/mcu_setup.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

// " (watchdog)"
std::string by_cause(std::uint8_t reset_cause) {
  const std::string word = motion::reset_cause_word(reset_cause);
  return word.empty() ? word : " (" + word + ")";
}

// Whether a motor is among those that the report of its MCU has.
bool is_reported(const Mcu& mcu, const motion::Motor& motor) {
  return motor.output().value < mcu.report().motor_count;
}

}  // namespace

Supervisor::Supervisor(Installation& installation, Journal& journal, Moves& moves,
                       const Positions& positions, const KeptPositions& kept,
                       const EmergencyStop& emergency_stop, std::vector<Service*> services,
                       Outputs& outputs)
    : installation_(installation),
      journal_(journal),
      moves_(moves),
      positions_(positions),
      kept_(kept),
      emergency_stop_(emergency_stop),
      services_(std::move(services)),
      outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) heard_.add();
}

void Supervisor::handle_events(std::int64_t now_us, Bus& bus) {
  const auto mcu_of = [&](const auto& event) -> Mcu& {
    return installation_[bus.mcus[event.mcu.value]];
  };
  const auto handle = Overloaded{
      [&](const link::McuOnline& event) { goes_online(now_us, mcu_of(event)); },
      [&](const link::McuOffline& event) { goes_offline(now_us, mcu_of(event)); },
      [&](const link::McuReported& event) { reports(now_us, mcu_of(event)); },
      [&](const link::RequestRefused& event) {
        for (Service* service : services_) {
          service->refuses(mcu_of(event), event.type, event.status);
        }
      },
      [&](const link::StartMissed& event) { misses_start(mcu_of(event), Output{event.motor}); },
      [&](const link::StartUnconfirmed& event) { moves_.withdraw_start(now_us, bus, event.at); },
      [&](const link::PositionUncertain& event) {
        is_uncertain(mcu_of(event), Output{event.motor});
      },
      [](const link::ProgramReported&) {},
      [&](const link::ReplacementFailed& event) { replans(now_us, mcu_of(event), event.motors); }};
  for (const link::Event& event : bus.master.take_events()) std::visit(handle, event);
}

// The MCU did not take what was planned: its motors go on as before.
void Supervisor::replans(std::int64_t now_us, const Mcu& mcu, std::uint16_t outputs) {
  std::vector<MotorId> again;
  for (const MotorId motor : mcu.motors()) {
    if (has_bit(outputs, installation_[motor].output())) again.push_back(motor);
  }
  moves_.plan_again(now_us, again);
}

void Supervisor::goes_online(std::int64_t now_us, Mcu& mcu) {
  const std::uint16_t boot_number = mcu.report().boot_number;
  Heard& heard = heard_[mcu.id];
  const auto before = std::exchange(heard.boot_number, boot_number);
  heard.report_us = now_us;
  const bool restarted = before && *before != boot_number;
  std::string stood;
  for (const MotorId id : mcu.motors()) {
    motion::Motor& motor = installation_[id];
    if (!is_reported(mcu, motor)) continue;
    const std::int64_t before_steps = motor.position_steps();
    motor.goes_online(mcu.report(), !before, restarted);
    if (restarted) {
      journal_.position_lost(id, before_steps);
      stood += (stood.empty() ? "" : ", ") + motor.name() + " at " + std::to_string(before_steps);
    } else if (before && !positions_.counter_being_set(id) && !kept_.being_restored(id)) {
      follow_position(id, before_steps);
    }
  }
  outputs_.log(restarted ? LogLevel::kWarning : LogLevel::kInfo, mcu.id,
               "MCU " + mcu.name() + " is ready, boot number " + std::to_string(boot_number) +
                   (restarted ? "; it restarted" + by_cause(mcu.report().reset_cause) +
                                    (kept_.keeps() ? ". "
                                                   : ", so its motors' positions are uncertain: "
                                                     "set or home them. ") +
                                    "Heard last before: " + stood
                              : ""));
  for (Service* service : services_) service->goes_online(mcu);
  installation_.changed = true;
}

// What clients and logs were told when it was lost was where it was heard last.
void Supervisor::follow_position(MotorId id, std::int64_t before_steps) {
  const motion::Motor& motor = installation_[id];
  if (motor.position_steps() == before_steps) return;
  journal_.position_corrected(id, before_steps);
  outputs_.log(LogLevel::kWarning, id,
               motor.name() + ": stands at " + std::to_string(motor.position_steps()) +
                   ", not at " + std::to_string(before_steps) + " where it was heard last: it " +
                   "moved on while its MCU was out of reach");
}

void Supervisor::goes_offline(std::int64_t now_us, Mcu& mcu) {
  const std::string cause = mcu.must_be_online().error().text();
  outputs_.log(LogLevel::kError, mcu.id, cause);
  const std::int64_t heard_utime_us =
      outputs_.wall_clock_us() - (now_us - heard_[mcu.id].report_us);
  // Before the services end their motion.
  for (const MotorId motor : mcu.motors()) {
    installation_[motor].goes_offline(heard_utime_us,
                                      installation_.drives()[motor].moved_by_people());
  }
  for (Service* service : services_) service->goes_offline(mcu, cause);
  installation_.changed = true;
}

void Supervisor::reports(std::int64_t now_us, Mcu& mcu) {
  heard_[mcu.id].report_us = now_us;
  const bool other_master = installation_.bus_of(mcu).hears_two_masters(now_us);
  for (const MotorId id : mcu.motors()) {
    motion::Motor& motor = installation_[id];
    if (!is_reported(mcu, motor)) continue;
    journal_.before_report(id, positions_.counter_being_set(id) || kept_.being_restored(id));
    moves_.take(now_us, id,
                motor.report({.of_mcu = mcu.report(),
                              .tick = mcu.view().tick,
                              .requests_open = mcu.busy(),
                              .emergency_stop_open = emergency_stop_.under_way(),
                              .other_master = other_master}));
  }
  journal_.after_report(mcu);
  for (Service* service : services_) service->reports(now_us, mcu);
}

void Supervisor::misses_start(const Mcu& mcu, Output output) {
  const auto id = mcu.motor_at(output);
  if (id && installation_[*id].start_of_run().is_missed(mcu.report())) moves_.misses_start(*id);
}

void Supervisor::is_uncertain(const Mcu& mcu, Output output) {
  const auto id = mcu.motor_at(output);
  if (!id) return;
  const std::string& reason = mcu.view().uncertain_reason;
  motion::Motor& motor = installation_[*id];
  motor.trust().is_uncertain(reason);
  outputs_.log(LogLevel::kError, *id, motor.name() + ": its position is uncertain: " + reason);
  installation_.changed = true;
}

void Supervisor::watch_for_other_masters(std::int64_t now_us) {
  for (const BusId id : installation_.buses()) {
    Bus& bus = installation_[id];
    const bool now = bus.hears_two_masters(now_us);
    if (std::exchange(bus.two_masters, now) == now) continue;
    installation_.changed = true;
    if (now) {
      outputs_.log(LogLevel::kError, {},
                   "bus " + bus.config.name +
                       ": another master talks on the bus; no moves are taken "
                       "until it is silent");
    } else {
      outputs_.log(LogLevel::kInfo, {}, "bus " + bus.config.name + ": the other master is silent");
      for (const McuId mcu : installation_.mcus()) {
        if (&installation_.bus_of(installation_[mcu]) == &bus) to_set_up_.push_back(mcu);
      }
    }
  }
  set_up_again();
}

// Tables, inputs and all else may be those of the other one. What they have already they are not
// given again, and a motion that has gone on keeps its table.
void Supervisor::set_up_again() {
  std::erase_if(to_set_up_, [this](McuId id) {
    Mcu& mcu = installation_[id];
    if (installation_.any_moves(mcu)) return false;
    mcu.bus().reconfigure(mcu.on_bus(), installation_.setup_of(id));
    installation_.changed = true;
    return true;
  });
}

}  // namespace bushd::daemon
