#include "daemon/services/pseudo_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <utility>

#include "base/overloaded.h"

namespace bushd::daemon {
namespace {

std::vector<double> positions_of(const config::PseudoLaw& law, const std::vector<double>& motors) {
  return std::visit(
      Overloaded{
          [&](const pseudo::LinearAxes& axes) { return axes.positions(motors); },
          [&](const pseudo::CurvedAxis& axis) { return std::vector{axis.position(motors)}; }},
      law);
}

Result<std::vector<double>> motors_for(const config::PseudoLaw& law,
                                       const std::vector<double>& positions,
                                       const std::vector<double>& motors_now) {
  return std::visit(Overloaded{[&](const pseudo::LinearAxes& axes) -> Result<std::vector<double>> {
                                 return axes.motors_for(positions, motors_now);
                               },
                               [&](const pseudo::CurvedAxis& axis) {
                                 return axis.motors_for(positions.front());
                               }},
                    law);
}

std::int64_t counts_per_unit(const config::PseudoAxis& axis) {
  std::int64_t counts = 1;
  for (int i = 0; i < axis.decimals; ++i) counts *= 10;
  return counts;
}

std::int64_t counts_of(const config::PseudoAxis& axis, double position) {
  const double counts = position * static_cast<double>(counts_per_unit(axis));
  constexpr double kMost = 9e18;
  return std::llround(std::clamp(counts, -kMost, kMost));
}

// What all motors know well enough, the worst last.
int rank(api::Trust trust) {
  switch (trust) {
    case api::Trust::kKnown:
      return 0;
    case api::Trust::kRestored:
      return 1;
    case api::Trust::kStale:
      return 2;
    case api::Trust::kUncertain:
      return 3;
    case api::Trust::kUnknown:
      break;
  }
  return 4;
}

std::string text_of(const config::PseudoAxis& axis, double position) {
  // Beyond what any axis has: with all its digits nobody could read it.
  constexpr double kMost = 1e15;
  if (std::abs(position) >= kMost) return fmt::format("{:g} {}", position, axis.unit);
  return fmt::format("{:.{}f} {}", position, axis.decimals, axis.unit);
}

// Other steps, or by more of one than what is computed in doubles may be off.
bool differs(const units::Steps& a, const units::Steps& b) {
  constexpr std::int64_t kLeastParts = 1 << 12;  // 1e-6 of a step
  return a.whole != b.whole || std::abs(a.parts - b.parts) >= kLeastParts;
}

// A motor without a unit has whole steps only.
api::Amount amount_of(const motion::Motor& motor, double user, const units::Steps& steps) {
  if (motor.scale().coordinates().has_unit()) return api::UserUnits{user};
  return steps.whole;
}

// All that a request names which may be a computed axis.
api::MotorNames names_in(const auto& request) {
  api::MotorNames names;
  if constexpr (requires { api::MotorNames(request.motors); }) names = request.motors;
  if constexpr (requires { request.motors.front().motor; }) {
    for (const auto& one : request.motors) names.push_back(one.motor);
  }
  if constexpr (requires { request.changes; }) {
    for (const auto& change : request.changes) names.push_back(change.motor);
  }
  if constexpr (requires { request.motor; }) names.push_back(request.motor);
  if constexpr (requires { request.group; }) names.push_back(request.group);
  return names;
}

// What ends or holds motion, or lifts that, is meant for the motors of an axis.
template <class R>
concept MeantForMotors = std::same_as<decltype(R::motors), api::MotorNames> &&
                         (api::ends(R::motion()) || requires { R::kNamesGroups; });

// The state of all motors together, but for the position.
void take_worst(api::MotorState& all, const api::MotorState& motor) {
  if (motor.activity != api::Activity::kResting) all.activity = api::Activity::kMoving;
  all.moving = all.moving || motor.moving;
  all.enabled = all.enabled && motor.enabled;
  all.input = all.input || motor.input;
  all.paused = all.paused || motor.paused;
  all.held = all.held || motor.held;
  if (rank(motor.trust) <= rank(all.trust)) return;
  all.trust = motor.trust;
  all.uncertain_reason = motor.name + ": " + motor.uncertain_reason;
  all.heard_utime_us = motor.heard_utime_us;
}

}  // namespace

std::optional<PseudoAxes::Place> PseudoAxes::find(const std::string& name) const {
  const std::vector<config::Pseudo>& pseudos = installation_.config().pseudos;
  for (std::size_t i = 0; i < pseudos.size(); ++i) {
    const auto axis = std::ranges::find(pseudos[i].axes, name, &config::PseudoAxis::name);
    if (axis == pseudos[i].axes.end()) continue;
    return Place{.pseudo = i, .axis = static_cast<std::size_t>(axis - pseudos[i].axes.begin())};
  }
  return std::nullopt;
}

std::string PseudoAxes::motors_text(const config::Pseudo& pseudo) const {
  std::string text;
  for (const MotorId motor : pseudo.motors) {
    text += (text.empty() ? "" : ", ") + installation_[motor].name();
  }
  return text;
}

std::vector<MotorId> PseudoAxes::motors_of(const api::Move& move) const {
  std::vector<MotorId> motors;
  for (const api::MotorAmount& amount : move.motors) {
    const auto place = find(amount.motor);
    if (!place) continue;
    for (const MotorId motor : installation_.config().pseudos[place->pseudo].motors) {
      if (std::ranges::find(motors, motor) == motors.end()) motors.push_back(motor);
    }
  }
  return motors;
}

// Stands for the session of one request until that is answered.
class PseudoAxes::Told : public api::Session {
 public:
  Told(std::shared_ptr<api::Session> session, const PseudoAxes& axes, std::vector<Place> places)
      : Session(session->transport(), session->client_id(), session->may_command(),
                session->credentials()),
        session_(std::move(session)),
        axes_(axes),
        places_(std::move(places)) {}

  void answer(std::int64_t number, const api::Reply& reply) override {
    const auto* completed = std::get_if<api::Completed>(&reply);
    const auto* motors = completed == nullptr
                             ? nullptr
                             : std::get_if<std::vector<api::MotorResult>>(&completed->detail);
    if (motors == nullptr) return session_->answer(number, reply);
    std::vector<api::MotorResult> all;
    for (const Place& place : places_) all.push_back(axes_.result_of(place, *completed));
    all.insert(all.end(), motors->begin(), motors->end());
    session_->answer(number, api::Completed{.outcome = completed->outcome,
                                            .reason = completed->reason,
                                            .detail = std::move(all)});
  }
  bool gone() const override { return session_->gone(); }

 private:
  std::shared_ptr<api::Session> session_;
  const PseudoAxes& axes_;
  std::vector<Place> places_;
};

api::Asker PseudoAxes::told_of_axes(const api::Asker& asker, const api::Move& move) const {
  std::vector<Place> places;
  for (const api::MotorAmount& amount : move.motors) {
    if (const auto place = find(amount.motor)) places.push_back(*place);
  }
  if (places.empty() || !asker.session) return asker;
  return {.session = std::make_shared<Told>(asker.session, *this, std::move(places)),
          .number = asker.number,
          .after_stops = asker.after_stops};
}

// Where it stands is what its motors make of it, those too that had no way to go.
api::MotorResult PseudoAxes::result_of(const Place& place, const api::Completed& of_motors) const {
  const config::Pseudo& pseudo = installation_.config().pseudos[place.pseudo];
  const config::PseudoAxis& axis = pseudo.axes[place.axis];
  std::vector<double> at;
  for (const MotorId id : pseudo.motors) {
    const motion::Motor& motor = installation_[id];
    at.push_back(motor.scale().coordinates().user_of(motor.position_steps()));
  }
  const double position = positions_of(pseudo.law, at)[place.axis];
  api::MotorResult result{.motor = axis.name,
                          .outcome = of_motors.outcome,
                          .position_steps = counts_of(axis, position),
                          .user = position,
                          .dial = position,
                          .unit = axis.unit,
                          .precision = axis.decimals};
  for (const auto& motor : std::get<std::vector<api::MotorResult>>(of_motors.detail)) {
    result.who = motor.who;
    result.legs = std::max(result.legs, motor.legs);
  }
  return result;
}

Result<std::optional<api::Request>> PseudoAxes::of_motors(const api::Request& request) const {
  using Answer = Result<std::optional<api::Request>>;
  if (size() == 0) return std::nullopt;
  const auto named = [this](auto copy) -> Answer {
    api::MotorNames names;
    bool any = false;
    for (std::string& name : copy.motors) {
      const auto place = find(name);
      if (!place) {
        names.push_back(std::move(name));
        continue;
      }
      any = true;
      for (const MotorId motor : installation_.config().pseudos[place->pseudo].motors) {
        names.push_back(installation_[motor].name());
      }
    }
    if (!any) return std::nullopt;
    std::ranges::sort(names);
    names.erase(std::unique(names.begin(), names.end()), names.end());
    copy.motors = std::move(names);
    return api::Request(std::move(copy));
  };
  const auto refuse = [this](const std::string& name) -> Answer {
    const auto place = find(name);
    if (!place) return std::nullopt;
    return fail(fmt::format("{} is computed from motors {}; name these", name,
                            motors_text(installation_.config().pseudos[place->pseudo])));
  };
  return std::visit(Overloaded{[&](const api::Move& move) -> Answer {
                                 const auto is_computed = [this](const api::MotorAmount& amount) {
                                   return find(amount.motor).has_value();
                                 };
                                 if (!std::ranges::any_of(move.motors, is_computed))
                                   return std::nullopt;
                                 auto asked = of_motors(move);
                                 if (!asked) return fail(asked.error());
                                 return std::move(*asked);
                               },
                               [&](const MeantForMotors auto& r) { return named(r); },
                               [&](const auto& r) -> Answer {
                                 for (const std::string& name : names_in(r)) {
                                   if (auto refused = refuse(name); !refused) return refused;
                                 }
                                 return std::nullopt;
                               }},
                    request);
}

Result<std::vector<double>> PseudoAxes::positions_asked(const api::Move& move,
                                                        const config::Pseudo& pseudo,
                                                        const std::vector<double>& motors) const {
  std::vector<double> positions = positions_of(pseudo.law, motors);
  for (const api::MotorAmount& amount : move.motors) {
    const auto place = find(amount.motor);
    const config::Pseudo* its = place ? &installation_.config().pseudos[place->pseudo] : nullptr;
    if (its != &pseudo) {
      return fail(
          fmt::format("{} does not go with the axes that are computed from {}; move it by a "
                      "request of its own",
                      amount.motor, motors_text(pseudo)));
    }
    const config::PseudoAxis& axis = pseudo.axes[place->axis];
    const auto* steps = std::get_if<std::int64_t>(&amount.amount);
    const double asked =
        steps != nullptr ? static_cast<double>(*steps) / static_cast<double>(counts_per_unit(axis))
                         : std::get<api::UserUnits>(amount.amount).value;
    double& position = positions[place->axis];
    position = move.kind == api::Move::Kind::kAbsolute ? asked : position + asked;
    if (!std::isfinite(position)) return fail(axis.name + ": a target that is not finite");
    const auto& limits = axis.soft_limits;
    if (!limits || (position >= limits->low && position <= limits->high)) continue;
    return fail(fmt::format("{}: target {} is beyond the soft limit at {}; allowed: {} to {}",
                            axis.name, text_of(axis, position),
                            text_of(axis, position < limits->low ? limits->low : limits->high),
                            text_of(axis, limits->low), text_of(axis, limits->high)));
  }
  return positions;
}

Result<api::Request> PseudoAxes::of_motors(const api::Move& move) const {
  const auto is_computed = [this](const api::MotorAmount& amount) {
    return find(amount.motor).has_value();
  };
  const auto first = std::ranges::find_if(move.motors, is_computed);
  const config::Pseudo& pseudo = installation_.config().pseudos[find(first->motor)->pseudo];
  // Those that are not named keep to where they are, or have been told to go.
  std::vector<units::Steps> from;
  std::vector<double> now;
  for (const MotorId id : pseudo.motors) {
    const motion::Motor& motor = installation_[id];
    const auto steps = motor.reach().distance_from();
    if (!steps) return fail(motor.name() + ": " + steps.error().message);
    from.push_back(*steps);
    now.push_back(motor.scale().coordinates().user_of(*steps));
  }
  const auto positions = positions_asked(move, pseudo, now);
  if (!positions) return fail(positions.error());
  const auto motors = motors_for(pseudo.law, *positions, now);
  if (!motors) return fail(first->motor + ": " + motors.error().message);

  api::MoveLine line{.kind = api::Move::Kind::kAbsolute, .motors = {}, .dry_run = move.dry_run};
  double longest = 0;  // way of a motor, in its unit
  bool steps = false;  // some motor makes one
  for (std::size_t j = 0; j < motors->size(); ++j) {
    const motion::Motor& motor = installation_[pseudo.motors[j]];
    const auto target = motor.scale().coordinates().unrounded_of_user((*motors)[j]);
    if (!target) return fail(motor.name() + ": " + target.error().message);
    longest = std::max(longest, std::abs((*motors)[j] - now[j]));
    if (!differs(*target, from[j])) continue;
    steps = steps || target->whole != from[j].whole;
    line.motors.push_back({motor.name(), amount_of(motor, (*motors)[j], *target)});
  }
  // Where it stands already; its first motor says so.
  if (line.motors.empty()) {
    const motion::Motor& motor = installation_[pseudo.motors.front()];
    line.motors.push_back({motor.name(), amount_of(motor, now.front(), from.front())});
  }
  if (move.speed) {
    if (move.speed->in_steps) {
      return fail(first->motor + ": a computed axis has no steps; give its speed in its unit");
    }
    // The share of the way that each axis may make in a second.
    const std::vector<double> before = positions_of(pseudo.law, now);
    double farthest = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      farthest = std::max(farthest, std::abs((*positions)[i] - before[i]));
    }
    line.speed = move.speed;
    if (farthest > 0 && longest > 0) line.speed->per_s *= longest / farthest;
  }
  // Less than a step of all is what they have been told, and no way.
  if (steps && line.motors.size() > 1) return api::Request(std::move(line));
  return api::Request(api::Move{.kind = line.kind,
                                .motors = std::move(line.motors),
                                .dry_run = line.dry_run,
                                .speed = line.speed});
}

api::StateSnapshot PseudoAxes::state(std::size_t index, const StateOf& state_of) const {
  const config::Pseudo& pseudo = installation_.config().pseudos[index];
  const Mcu& mcu = installation_.mcu_of(pseudo.motors.front());
  api::StateSnapshot snapshot;
  snapshot.bus = installation_.bus_of(mcu).config.name;
  snapshot.mcu = snapshot.bus + ":" + pseudo.axes.front().name;
  snapshot.state = api::McuState::kReady;
  api::MotorState all;
  all.enabled = true;
  std::vector<double> positions;
  std::vector<double> targets;
  std::vector<double> later;  // by the speeds of now
  constexpr double kLaterS = 1e-3;
  for (const MotorId id : pseudo.motors) {
    const api::MotorState motor = state_of(id);
    const motion::Motor& of = installation_[id];
    positions.push_back(motor.user);
    targets.push_back(motor.user_target);
    const double way = of.scale().coordinates().user_of(1) - of.scale().coordinates().user_of(0);
    later.push_back(motor.user + way * motor.velocity_steps_per_s * kLaterS);
    take_worst(all, motor);
    if (!installation_.mcu_of(id).online()) snapshot.state = api::McuState::kOffline;
    if (motor.moving && snapshot.state == api::McuState::kReady) {
      snapshot.state = api::McuState::kRunning;
    }
  }
  const auto* curved = std::get_if<pseudo::CurvedAxis>(&pseudo.law);
  const units::Coordinates& first = installation_[pseudo.motors.front()].scale().coordinates();
  const double step = std::abs(first.user_of(1) - first.user_of(0));
  // The step that is nearest to an end may be beyond it.
  if (curved != nullptr && curved->beyond(positions) > step / 2 &&
      rank(all.trust) < rank(api::Trust::kUncertain)) {
    all.trust = api::Trust::kUncertain;
    all.uncertain_reason =
        installation_[pseudo.motors.front()].name() + " stands beyond the calibration";
  }
  positions = positions_of(pseudo.law, positions);
  targets = positions_of(pseudo.law, targets);
  later = positions_of(pseudo.law, later);
  for (std::size_t i = 0; i < pseudo.axes.size(); ++i) {
    const config::PseudoAxis& axis = pseudo.axes[i];
    api::MotorState state = all;
    state.name = axis.name;
    state.user = state.dial = positions[i];
    state.user_target = targets[i];
    const bool known = state.trust != api::Trust::kUnknown;
    state.position_steps = known ? counts_of(axis, positions[i]) : 0;
    state.target_steps = known ? counts_of(axis, targets[i]) : 0;
    state.velocity_steps_per_s =
        (later[i] - positions[i]) / kLaterS * static_cast<double>(counts_per_unit(axis));
    snapshot.motors.push_back(std::move(state));
  }
  return snapshot;
}

api::Description PseudoAxes::description(std::size_t index) const {
  const config::Pseudo& pseudo = installation_.config().pseudos[index];
  const config::Bus& bus = installation_.bus_of(installation_.mcu_of(pseudo.motors.front())).config;
  api::Description description{.bus = bus.name,
                               .mcu = bus.name + ":" + pseudo.axes.front().name,
                               .address = 0,
                               .tick_ns = bus.tick_ns(),
                               .emergency_stop = api::StopMode::kRamp,
                               .motors = {}};
  for (std::size_t i = 0; i < pseudo.axes.size(); ++i) {
    const config::PseudoAxis& axis = pseudo.axes[i];
    description.motors.push_back(
        {.name = axis.name,
         .output = static_cast<std::uint8_t>(i),
         .group = {},
         .table = {},
         .text = "computed from " + motors_text(pseudo),
         .scale = {.unit = axis.unit,
                   .steps_per_unit = {.numerator = counts_per_unit(axis), .denominator = 1},
                   .decimals = axis.decimals},
         .soft_limits = axis.soft_limits});
  }
  return description;
}

}  // namespace bushd::daemon
