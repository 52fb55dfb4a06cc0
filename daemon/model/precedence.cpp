#include "daemon/model/precedence.h"

#include <type_traits>
#include <utility>

namespace bushd::daemon {
namespace {

// None named: all.
template <class Asked>
std::vector<MotorId> motors_of(const Installation& installation, const Asked& asked) {
  api::MotorNames names;
  if constexpr (requires { asked.motors.front().amount; }) {
    if (asked.motors.empty()) return {};
    for (const api::MotorAmount& amount : asked.motors) names.push_back(amount.motor);
  } else if constexpr (requires { asked.motors; }) {
    names = asked.motors;
  } else if constexpr (requires { asked.motor; }) {
    names = {asked.motor};
  } else if constexpr (!std::is_same_v<Asked, api::EmergencyStop>) {
    static_assert(
        Asked::motion() == api::Motion::kNone || Asked::motion() == api::Motion::kBeginsByService,
        "its motors are asked for: name them, or say here which they are");
    return {};
  }
  return installation.find_known(names, requires { asked.kNamesGroups; }).motors;
}

std::vector<MotorId> motors_of(const Installation& installation, const api::Home& asked) {
  if (!asked.all) return installation.find_known(asked.motors, false).motors;
  std::vector<MotorId> motors;
  for (const MotorId motor : installation.motors()) {
    if (installation.config()[motor].home) motors.push_back(motor);
  }
  return motors;
}

}  // namespace

std::string text_of(const api::Asker& asker) {
  if (!asker.session) return "SIGHUP";
  return "command " + std::to_string(asker.number) + " of " + asker.session->text();
}

Precedence::Precedence(const Installation& installation) : installation_(installation) {
  for ([[maybe_unused]] const MotorId motor : installation.motors()) {
    newest_.add();
    holds_.add();
    emergency_stops_.add();
  }
}

void Precedence::note(const api::Asker& asker, const api::Request& request) {
  const Stop stop{asker.after_stops, std::make_shared<const std::string>(text_of(asker))};
  const auto note = [&stop](Stops& stops, const std::vector<MotorId>& motors) {
    for (const MotorId motor : motors) {
      if (stops[motor].number < stop.number) stops[motor] = stop;
    }
  };
  const auto note_motors = [&](const auto& asked) {
    if (!api::ends(asked.motion())) return;
    std::vector<MotorId> motors = motors_of(installation_, asked);
    if (asked.motion() == api::Motion::kEndsOnLines) {
      motors = installation_.with_lines(std::move(motors));
    }
    note(newest_, motors);
    using Asked = std::remove_cvref_t<decltype(asked)>;
    if constexpr (std::is_same_v<Asked, api::Hold>) note(holds_, motors);
    if constexpr (std::is_same_v<Asked, api::EmergencyStop>) note(emergency_stops_, motors);
  };
  std::visit(note_motors, request);
}

void Precedence::note_all(const std::string& by) {
  const Stop stop{counted_.count(), std::make_shared<const std::string>(by)};
  for (const MotorId motor : newest_.ids()) newest_[motor] = stop;
}

std::optional<Precedence::Overtaken> Precedence::find(const Stops& stops, std::uint64_t after_stops,
                                                      const std::vector<MotorId>& motors) const {
  for (const MotorId motor : motors) {
    if (stops[motor].number > after_stops) return Overtaken{motor, *stops[motor].by, motors};
  }
  return std::nullopt;
}

std::optional<Precedence::Overtaken> Precedence::overtaken(
    std::uint64_t after_stops, const std::vector<MotorId>& motors) const {
  return find(newest_, after_stops, motors);
}

std::optional<Precedence::Overtaken> Precedence::overtaken(const api::Asker& asker,
                                                           const api::Request& request) const {
  if (asker.after_stops >= counted_.stops()) return std::nullopt;
  const auto by = [&](const auto& asked) -> std::optional<Overtaken> {
    const auto stops = [&]() -> const Stops* {
      if (asked.motion() == api::Motion::kBegins) return &newest_;
      if (asked.motion() == api::Motion::kLiftsHold) return &holds_;
      if (asked.motion() == api::Motion::kLiftsEmergencyStop) return &emergency_stops_;
      return nullptr;
    }();
    if (stops == nullptr) return std::nullopt;
    return find(*stops, asker.after_stops, motors_of(installation_, asked));
  };
  return std::visit(by, request);
}

}  // namespace bushd::daemon
