#include "daemon/core/core.h"

#include <algorithm>

#include "base/overloaded.h"
#include "daemon/core/request_log.h"
#include "daemon/model/name_patterns.h"

namespace bushd::daemon {

Core::Core(const config::Config& config, Outputs& outputs, std::uint16_t master)
    : outputs_(outputs),
      installation_(config, master),
      interlocks_(installation_),
      open_moves_(installation_),
      journal_(installation_, outputs),
      positions_(installation_, interlocks_, journal_, outputs),
      kept_(installation_, positions_, journal_, outputs),
      dry_runs_(installation_),
      tables_(installation_, interlocks_, outputs),
      moves_(installation_, interlocks_, journal_, open_moves_, dry_runs_, outputs),
      idle_drivers_(installation_, outputs,
                    [this](MotorId motor) { return waiting_requests_.holds(motor); }),
      homing_(installation_, interlocks_, open_moves_, moves_, kept_, idle_drivers_, outputs),
      travels_(installation_, interlocks_, open_moves_, kept_, idle_drivers_, outputs),
      programs_(installation_, interlocks_, open_moves_, kept_, idle_drivers_, outputs),
      local_inputs_(installation_),
      stops_(installation_, moves_, homing_, travels_, programs_, local_inputs_, open_moves_),
      jogs_(installation_, interlocks_, moves_, open_moves_),
      pauses_(installation_, interlocks_, moves_, programs_, open_moves_),
      holds_(installation_, interlocks_, moves_, local_inputs_, open_moves_, kept_, outputs),
      lines_(installation_, interlocks_, journal_, moves_, open_moves_, dry_runs_),
      trajectories_(installation_, interlocks_, journal_, moves_, open_moves_),
      emergency_stop_(installation_, interlocks_, homing_, open_moves_, kept_, outputs),
      link_faults_(installation_, emergency_stop_, outputs),
      drivers_(installation_, interlocks_, emergency_stop_),
      trigger_(installation_, interlocks_, moves_, open_moves_),
      while_connected_(installation_, moves_, open_moves_),
      position_compare_(installation_),
      pseudo_axes_(installation_),
      state_(
          installation_, pseudo_axes_, open_moves_,
          [this](McuId mcu) { return programs_.text(mcu); }, outputs),
      line_tables_(installation_, lines_),
      line_room_(installation_),
      waiting_requests_(
          installation_, interlocks_, open_moves_, kept_, idle_drivers_, line_tables_, line_room_,
          [this](std::int64_t now_us, const api::Asker& asker, const api::Request& request) {
            carry_out(now_us, asker, request);
          },
          [this] { return moves_.begins(); },
          [this](const api::Request& request) { return would_take(request); }),
      health_(installation_, outputs),
      settings_(installation_, positions_, kept_, journal_, outputs,
                [this](MotorId motor) { return waiting_requests_.holds(motor); }),
      camac_(installation_, interlocks_, open_moves_, tables_, lines_, travels_, programs_, kept_,
             outputs,
             [this](std::int64_t now_us, const api::Asker& asker, const api::Request& request) {
               this->request(now_us, logged(asker, request, outputs_), request);
             }),
      // What an MCU's positions are worth comes before whoever goes by that.
      services_{
          &kept_,        &idle_drivers_,     &journal_,  &moves_,           &homing_,
          &link_faults_, &local_inputs_,     &programs_, &stops_,           &emergency_stop_,
          &drivers_,     &positions_,        &trigger_,  &while_connected_, &position_compare_,
          &tables_,      &waiting_requests_, &jogs_,     &pauses_,          &holds_,
          &lines_,       &settings_,         &travels_,  &camac_,           &trajectories_},
      supervisor_(installation_, journal_, moves_, positions_, kept_, emergency_stop_, services_,
                  outputs) {
  positions_.set_offset_listener(
      [this](MotorId motor, const units::Coordinates& before, const api::Asker& by) {
        settings_.offset_set(motor, before, by);
      });
  positions_.set_answerer([this](const api::Asker& asker, api::Completed done) {
    kept_.answer_when_kept(asker, std::move(done));
  });
  positions_.set_listener([this](MotorId motor, std::int64_t from_steps, const api::Asker& by) {
    kept_.past({.motor = installation_[motor].name(),
                .what = "set",
                .who = text_of(by),
                .from_steps = from_steps,
                .to_steps = installation_[motor].position_steps(),
                .result = std::string(api::word(api::Outcome::kDone))});
  });
  drivers_.set_listener([this](McuId mcu) { idle_drivers_.switched(mcu); });
  kept_.set_listener([this] {
    emergency_stop_.take_kept();
    settings_.take_kept();
    holds_.take_kept();
    camac_.take_kept();
    programs_.take_kept();
  });
  open_moves_.set_listener([this](const OpenMoves::Ended& ended) {
    const motion::Motor& motor = installation_[ended.motor];
    kept_.past({.motor = motor.name(),
                .what = std::string(word(ended.purpose)),
                .who = text_of(ended.asker),
                .from_steps = ended.from_steps,
                .to_steps = motor.position_steps(),
                .result = std::string(api::word(ended.outcome)),
                .reason = ended.reason});
  });
}

void Core::port_opened(std::int64_t now_us, BusId bus, const std::string& path) {
  installation_[bus].master.port_opened(now_us);
  installation_[bus].port_state = "open";
  installation_[bus].port = path;
  health_.port_changed();
  installation_.changed = true;
}

void Core::port_lost(std::int64_t now_us, BusId bus, const std::string& cause) {
  installation_[bus].master.port_lost(now_us, cause);
  installation_[bus].port_state = cause;
  installation_[bus].port.clear();
  health_.port_changed();
  supervisor_.handle_events(now_us, installation_[bus]);
  installation_.changed = true;
}

void Core::receive(std::int64_t now_us, BusId bus, std::span<const std::uint8_t> bytes) {
  installation_[bus].master.receive(now_us, bytes);
  supervisor_.handle_events(now_us, installation_[bus]);
}

void Core::pulse_status(std::int64_t now_us, BusId bus, const link::PulseStatus& status) {
  installation_[bus].offers.pulse_port->pulse_status(now_us, status);
  supervisor_.handle_events(now_us, installation_[bus]);
}

void Core::request(std::int64_t now, const api::Asker& who, const api::Request& as_written) {
  state_.look_anew();
  const auto of_patterns = with_motors_of_patterns(installation_, as_written);
  const api::Request& as_asked = of_patterns ? *of_patterns : as_written;
  // Where a computed axis would go is asked where its motors stand: after a stop, elsewhere.
  const auto* move = std::get_if<api::Move>(&as_asked);
  const api::Asker as_counted = move != nullptr ? pseudo_axes_.told_of_axes(who, *move) : who;
  if (move != nullptr && !move->dry_run) {
    const auto by =
        open_moves_.precedence().overtaken(as_counted.after_stops, pseudo_axes_.motors_of(*move));
    if (by) return open_moves_.not_begun(as_counted, *by);
  }
  const auto of_motors = pseudo_axes_.of_motors(as_asked);
  if (!of_motors) return as_counted.answer(api::Refused{of_motors.error().text()});
  const api::Request& request = *of_motors ? **of_motors : as_asked;
  Precedence& precedence = open_moves_.precedence();
  const bool ends = api::ends_motion(request);
  api::Asker asker = as_counted;
  if (asker.after_stops == api::Asker::kNotCounted) {
    asker.after_stops = ends ? precedence.counted().count() : precedence.stops();
  }
  if (ends) {
    precedence.note(asker, request);
    end_overtaken(now);
  } else if (const auto by = precedence.overtaken(asker, request)) {
    return open_moves_.not_begun(asker, *by);
  }
  if (!waiting_requests_.hold(now, asker, request)) carry_out(now, asker, request);
}

// Paths, trajectories and lines for the trigger are found out about when they are carried out:
// their points are many, or their MCUs have yet to get a table.
bool Core::would_take(const api::Request& request) const {
  return std::visit(Overloaded{[&](const api::Move& r) { return moves_.would_take(r); },
                               [&](const api::MoveLine& r) { return lines_.would_take(r); },
                               [&](const api::Arm& r) { return trigger_.would_take(r); },
                               [&](const api::Jog& r) { return jogs_.would_take(r); },
                               [&](const api::SetPosition& r) { return positions_.would_take(r); },
                               [](const auto&) { return true; }},
                    request);
}

void Core::carry_out(std::int64_t now, const api::Asker& asker, const api::Request& request) {
  std::visit(Overloaded{
                 [&](const api::Move& r) { moves_.request(now, asker, r); },
                 [&](const api::Stop& r) { stops_.request(now, asker, r); },
                 [&](const api::EmergencyStop& r) { emergency_stop_.request(now, asker, r); },
                 [&](const api::Enable& r) { drivers_.request(now, asker, r); },
                 [&](const api::Disable& r) { drivers_.request(now, asker, r); },
                 [&](const api::ClearFaults& r) { drivers_.request(now, asker, r); },
                 [&](const api::SetPosition& r) { positions_.request(now, asker, r); },
                 [&](const api::UseTable& r) { tables_.request(asker, r); },
                 [&](const api::ReloadTables& r) { tables_.request(asker, r); },
                 [&](const api::Home& r) { homing_.request(asker, r); },
                 [&](const api::Arm& r) {
                   if (!r.while_connected || while_connected_.take(asker)) {
                     trigger_.request(asker, r);
                   }
                 },
                 [&](const api::Disarm& r) { trigger_.request(asker, r); },
                 [&](const api::PositionCompare& r) { position_compare_.request(now, asker, r); },
                 [&](const api::ListTables& r) { outputs_.serve_tables(asker, r); },
                 [&](const api::GetTable& r) { outputs_.serve_tables(asker, r); },
                 [&](const api::SetTable& r) { outputs_.serve_tables(asker, r); },
                 [&](const api::Confirm& r) { kept_.request(asker, r); },
                 [&](const api::GetHistory& r) { kept_.request(asker, r); },
                 [&](const api::Jog& r) { jogs_.request(now, asker, r); },
                 [&](const api::Pause& r) { pauses_.request(now, asker, r); },
                 [&](const api::Resume& r) { pauses_.request(now, asker, r); },
                 [&](const api::Hold& r) { holds_.request(now, asker, r); },
                 [&](const api::Release& r) { holds_.request(asker, r); },
                 [&](const api::Configure& r) { settings_.request(asker, r); },
                 [&](const api::MoveLine& r) { lines_.request(now, asker, r); },
                 [&](const api::MovePath& r) { lines_.request(asker, r); },
                 [&](const api::Camac& r) { camac_.request(asker, r); },
                 [&](const api::Follow& r) { trajectories_.request(now, asker, r); },
                 [&](const api::ArmLine& r) {
                   if (!r.while_connected || while_connected_.take(asker)) lines_.request(asker, r);
                 },
                 [&](const api::PutProgram& r) { programs_.request(asker, r); },
                 [&](const api::EraseProgram& r) { programs_.request(asker, r); },
                 [&](const api::RunPrograms& r) { programs_.request(asker, r); },
                 [&](const api::ListPrograms& r) { programs_.request(asker, r); },
             },
             request);
}

void Core::keep_up(std::int64_t now_us) {
  for (const BusId id : installation_.buses()) {
    const std::span<const std::uint8_t> bytes = installation_[id].master.step(now_us);
    if (!bytes.empty()) outputs_.send(id, bytes);
    const link::PulsePort* port = installation_[id].offers.pulse_port;
    const link::PulseOrder* order = port != nullptr ? port->pulse_order() : nullptr;
    if (order != nullptr) outputs_.pulse(id, *order);
    supervisor_.handle_events(now_us, installation_[id]);
  }
  for (Service* service : services_) service->step(now_us);
  supervisor_.watch_for_other_masters(now_us);
  health_.step(now_us);
  state_.step(now_us);
}

void Core::work() {
  if (moves_.begins()) return moves_.work();
  if (lines_.plans()) return lines_.work();
  trajectories_in_turn_ = !trajectories_in_turn_ || dry_runs_.idle();
  if (trajectories_in_turn_ && !trajectories_.idle()) return trajectories_.work();
  dry_runs_.work();
}

bool Core::has_work() const {
  return moves_.begins() || lines_.plans() || !dry_runs_.idle() || !trajectories_.idle();
}

std::int64_t Core::next_wake_us() const {
  if (has_work()) return 0;
  std::int64_t wake =
      std::min({state_.next_wake_us(), health_.next_wake_us(), kept_.next_wake_us(),
                idle_drivers_.next_wake_us(), jogs_.next_wake_us(), programs_.next_wake_us()});
  for (const BusId id : installation_.buses()) {
    wake = std::min(wake, installation_[id].master.next_wake_us());
  }
  return wake;
}

void Core::shut_down(std::int64_t now_us) {
  installation_.shutting_down = true;
  state_.look_anew();
  const std::vector<MotorId> all = *installation_.find_or_all({});
  const std::string by = "the daemon, which ends";
  open_moves_.precedence().note_all(by);
  end_overtaken(now_us);
  open_moves_.stopped_by(all, by);
  programs_.leave();
  stops_.stop(now_us, all);
  for (const BusId bus : installation_.buses()) {
    link::SharedLine* line = installation_[bus].offers.shared_line;
    if (line != nullptr) line->enable_no_more();
  }
}

void Core::end_overtaken(std::int64_t now_us) {
  for (Service* service : services_) service->end_overtaken(now_us);
}

}  // namespace bushd::daemon
