#include "daemon/model/precedence.h"

#include <algorithm>
#include <concepts>
#include <utility>

#include "base/overloaded.h"

namespace bushd::daemon {
namespace {

// Requests are named all: a new one has to be placed.
template <class Request, class... Of>
concept OneOf = (std::same_as<Request, Of> || ...);

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
  const auto with_lines = [this](const api::MotorNames& names, bool groups) {
    return installation_.with_lines(installation_.find_known(names, groups).motors);
  };
  std::visit(
      Overloaded{[&](const api::Stop& r) { note(newest_, with_lines(r.motors, false)); },
                 [&](const api::EmergencyStop&) {
                   const auto all = with_lines({}, false);
                   note(newest_, all);
                   note(emergency_stops_, all);
                 },
                 [&](const api::Pause& r) { note(newest_, with_lines(r.motors, true)); },
                 [&](const api::Hold& r) {
                   const auto motors = installation_.find_known(r.motors, true).motors;
                   note(newest_, motors);
                   note(holds_, motors);
                 },
                 [&](const api::Disarm& r) {
                   note(newest_, installation_.find_known(r.motors, false).motors);
                 },
                 [&](const api::Jog& r) {
                   note(newest_, installation_.find_known({r.motor}, false).motors);
                 },
                 [](const OneOf<api::Move, api::Enable, api::Disable, api::ClearFaults,
                                api::SetPosition, api::UseTable, api::ReloadTables, api::Home,
                                api::Arm, api::PositionCompare, api::ListTables, api::GetTable,
                                api::SetTable, api::Confirm, api::GetHistory, api::Resume,
                                api::Release, api::Configure, api::MoveLine, api::MovePath,
                                api::Camac, api::Follow, api::ArmLine, api::PutProgram,
                                api::EraseProgram, api::RunPrograms, api::ListPrograms> auto&) {}},
      request);
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

std::vector<MotorId> Precedence::motors_of(const api::Home& request) const {
  if (!request.all) return installation_.find_known(request.motors, false).motors;
  std::vector<MotorId> motors;
  for (const MotorId motor : installation_.motors()) {
    if (installation_.config()[motor].home) motors.push_back(motor);
  }
  return motors;
}

std::optional<Precedence::Overtaken> Precedence::overtaken(const api::Asker& asker,
                                                           const api::Request& request) const {
  if (asker.after_stops >= counted_.stops()) return std::nullopt;
  using Answer = std::optional<Overtaken>;
  const auto moves = [&](const std::vector<MotorId>& motors) {
    return overtaken(asker.after_stops, motors);
  };
  const auto names = [this](const auto& amounts) {
    api::MotorNames all;
    for (const api::MotorAmount& amount : amounts) all.push_back(amount.motor);
    return all.empty() ? std::vector<MotorId>() : installation_.find_known(all, false).motors;
  };
  return std::visit(
      Overloaded{
          [&](const api::Move& r) { return r.dry_run ? Answer() : moves(names(r.motors)); },
          [&](const api::MoveLine& r) { return r.dry_run ? Answer() : moves(names(r.motors)); },
          [&](const api::Arm& r) { return moves(names(r.motors)); },
          [&](const api::ArmLine& r) { return moves(names(r.motors)); },
          [&](const api::Home& r) { return moves(motors_of(r)); },
          [&](const api::Jog& r) {
            return r.renew ? Answer() : moves(installation_.find_known({r.motor}, false).motors);
          },
          [&](const api::Resume& r) {
            return moves(installation_.find_known(r.motors, true).motors);
          },
          [&](const api::Release& r) {
            return find(holds_, asker.after_stops, installation_.find_known(r.motors, true).motors);
          },
          [&](const api::ClearFaults& r) {
            return find(emergency_stops_, asker.after_stops,
                        installation_.find_known(r.motors, false).motors);
          },
          // Only who lets these wait knows their motors.
          [](const OneOf<api::MovePath, api::Follow, api::Camac, api::RunPrograms> auto&) {
            return Answer();
          },
          [](const OneOf<api::Stop, api::EmergencyStop, api::Pause, api::Hold, api::Disarm,
                         api::Enable, api::Disable, api::SetPosition, api::UseTable,
                         api::ReloadTables, api::PositionCompare, api::ListTables, api::GetTable,
                         api::SetTable, api::Confirm, api::GetHistory, api::Configure,
                         api::PutProgram, api::EraseProgram, api::ListPrograms> auto&) {
            return Answer();
          }},
      request);
}

}  // namespace bushd::daemon
