#include "daemon/core/core.h"

#include <algorithm>
#include <concepts>
#include <type_traits>

#include "daemon/model/name_patterns.h"

namespace bushd::daemon {
namespace {

template <class Taker, class Asked>
concept TakesInTime = requires(Taker& taker, const api::Asker& asker, const Asked& asked) {
  taker.request(std::int64_t{}, asker, asked);
};
template <class Taker, class Asked>
concept TakesAnytime = requires(Taker& taker, const api::Asker& asker, const Asked& asked) {
  taker.request(asker, asked);
};
template <class Taker, class Asked>
constexpr int kTakes = TakesInTime<Taker, Asked> || TakesAnytime<Taker, Asked> ? 1 : 0;

template <class Taker, class Asked>
void give(Taker& taker, std::int64_t now_us, const api::Asker& asker, const Asked& asked) {
  if constexpr (TakesInTime<Taker, Asked>) {
    taker.request(now_us, asker, asked);
  } else if constexpr (TakesAnytime<Taker, Asked>) {
    taker.request(asker, asked);
  }
}

// What services are asked about before; so none is left out because its function cannot be called.
template <class Asked>
concept IsAskedBefore = std::is_same_v<Asked, api::Move> || std::is_same_v<Asked, api::MoveLine> ||
                        std::is_same_v<Asked, api::Arm> ||
                        std::is_same_v<Asked, api::SetPosition> || std::is_same_v<Asked, api::Jog>;
template <class Taker, class Asked>
concept WouldTake = requires(Taker& taker, const Asked& asked) {
  { taker.would_take(asked) } -> std::same_as<bool>;
};

template <class Taker, class Asked>
bool may_take(Taker& taker, const Asked& asked) {
  static_assert(WouldTake<Taker, Asked> == (IsAskedBefore<Asked> && (TakesInTime<Taker, Asked> ||
                                                                     TakesAnytime<Taker, Asked>)));
  if constexpr (WouldTake<Taker, Asked>) return taker.would_take(asked);
  return true;
}

}  // namespace

Core::Core(const config::Config& config, Outputs& outputs, std::uint16_t master)
    : outputs_(outputs), installation_(config, master) {
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

std::vector<Service*> Core::all_services() {
  return std::apply([](auto&... service) { return std::vector<Service*>{&service...}; },
                    services());
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
bool Core::would_take(const api::Request& request) {
  const auto by_all = [this](const auto& asked) {
    return std::apply([&](auto&... service) { return (may_take(service, asked) && ...); },
                      services());
  };
  return std::visit(by_all, request);
}

void Core::carry_out(std::int64_t now, const api::Asker& asker, const api::Request& request) {
  const auto by_one = [&](const auto& asked) {
    if constexpr (requires { asked.while_connected; }) {
      if (asked.while_connected && !while_connected_.take(asker)) return;
    }
    std::apply(
        [&](auto&... service) {
          static_assert((kTakes<decltype(service), decltype(asked)> + ...) == 1,
                        "one service has a function request() for each type of request");
          (give(service, now, asker, asked), ...);
        },
        services());
  };
  std::visit(by_one, request);
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
