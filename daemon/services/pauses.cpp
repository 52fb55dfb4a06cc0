#include "daemon/services/pauses.h"

#include <algorithm>
#include <utility>

#include "daemon/model/count_text.h"

namespace bushd::daemon {

Pauses::Pauses(Installation& installation, const Interlocks& interlocks, Moves& moves,
               Programs& programs, OpenMoves& open_moves)
    : installation_(installation),
      interlocks_(interlocks),
      moves_(moves),
      programs_(programs),
      open_(open_moves) {}

// What it does, which a pause leaves alone; "": nothing, or a motion that it pauses or ends.
std::string Pauses::left_alone(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  if (motor.is<motion::Homing>()) return "being homed";
  if (motor.is<motion::Armed>()) return "waiting for the trigger";
  if (motor.is<motion::Travelling>()) return "travelling by its MCU";
  if (motor.is<motion::Local>()) return "moved by local inputs";
  if (motion::follows_trajectory(motor)) return "following a trajectory";
  return {};
}

// It has come to its target, where it has yet to stand for its settling time. On a line motors come
// there one before the other, and pause together.
bool Pauses::settles(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  return !motor.is<motion::OnLine>() && !motor.is_paused() &&
         motor.position_steps() == motor.target_steps() &&
         installation_.mcu_of(id).view().tick >= motor.axis().end_tick();
}

void Pauses::request(std::int64_t now_us, const api::Asker& asker, const api::Pause& request) {
  auto [named, unknown] = installation_.find_known(request.motors, true);
  if (named.empty()) return asker.answer(api::Refused{unknown});
  named = installation_.with_lines(std::move(named));
  const auto follows = [this](MotorId id) { return motion::follows_trajectory(installation_[id]); };
  const auto moves = [this](MotorId id) { return installation_[id].moves(); };
  const auto trajectory = std::ranges::find_if(named, follows);
  if (trajectory != named.end() &&
      std::ranges::count_if(named, moves) == std::ranges::count_if(named, follows)) {
    return asker.answer(api::Refused{
        installation_[*trajectory].name() +
        " follows a trajectory, whose times go on: stop it, and follow the rest of the rows from "
        "where its motors stand"});
  }
  asker.answer(api::Accepted{});
  Pausing pausing{.asker = asker};
  if (!unknown.empty()) pausing.not_done(api::Outcome::kFault, unknown);
  const std::string mcus = installation_.not_online(named);
  if (!mcus.empty()) {
    const bool may_move = !request.motors.empty() || std::ranges::any_of(named, [this](MotorId id) {
      return installation_[id].trust().lost_in_motion();
    });
    pausing.not_done(may_move ? api::Outcome::kLink : api::Outcome::kDone,
                     "not online, so it is unknown whether they stand:" + mcus);
  }
  std::vector<MotorId> to_pause;
  std::vector<MotorId> jogs;
  for (const MotorId motor : named) {
    if (const std::string does = left_alone(motor); !does.empty()) {
      pausing.left[does].push_back(motor);
      if (motion::follows_trajectory(installation_[motor])) pausing.outcome = api::Outcome::kFault;
      continue;
    }
    if (installation_[motor].is<motion::InProgram>()) {
      programs_.pause(motor);
      pausing.motors.emplace(motor, INT64_MAX);  // nobody knows where it leads
      continue;
    }
    if (!moves(motor)) continue;
    if (installation_[motor].jogs()) {
      open_.say(motor, api::Outcome::kStopped,
                {api::Outcome::kStopped, "ended, because " + text_of(asker) + " paused it"});
      jogs.push_back(motor);
    } else if (settles(motor)) {
      pausing.left["at their targets"].push_back(motor);
      continue;
    } else if (!installation_[motor].stops() || installation_[motor].is_paused()) {
      to_pause.push_back(motor);
    } else {
      pausing.left["being stopped"].push_back(motor);
      pausing.stopping.insert(motor);
    }
    pausing.motors.emplace(motor, installation_[motor].target_steps());
  }
  moves_.pause(now_us, to_pause);
  moves_.stop(now_us, jogs);
  open_pauses_.add(std::move(pausing), api::done("carried out; its end is not waited for"));
}

void Pauses::request(std::int64_t now_us, const api::Asker& asker, const api::Resume& request) {
  const auto motors = installation_.find_with_groups(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  if (const auto may = interlocks_.may_move(); !may) {
    return asker.answer(api::Refused{may.error().text()});
  }
  std::vector<MotorId> paused;
  std::vector<MotorId> in_programs;
  for (const MotorId motor : installation_.with_lines(*motors)) {
    const bool in_program = programs_.is_paused(motor);
    if (!installation_[motor].is_paused() && !in_program) continue;
    if (in_program) {
      if (const auto may = programs_.may_resume(motor); !may) {
        return asker.answer(api::Refused{installation_[motor].name() + ": " + may.error().text()});
      }
      in_programs.push_back(motor);
      continue;
    }
    if (const auto may = interlocks_.may_move(motor); !may) {
      return asker.answer(api::Refused{installation_[motor].name() + ": " + may.error().text()});
    }
    paused.push_back(motor);
  }
  asker.answer(api::Accepted{});
  moves_.resume(now_us, paused);
  for (const MotorId motor : in_programs) programs_.resume(motor);
  installation_.changed = true;
  asker.answer(api::done("resumed: " + count_text(paused.size() + in_programs.size())));
}

void Pauses::Pausing::not_done(api::Outcome how, const std::string& what) {
  outcome = std::max(outcome, how);
  problems += "; " + what;
}

// Whether a motor's part of it is over, and how.
bool Pauses::has_ended(Pausing& pausing, MotorId id, std::int64_t target) const {
  const motion::Motor& motor = installation_[id];
  if (motor.is<motion::InProgram>() && !programs_.is_paused(id)) {
    const Mcu& mcu = installation_.mcu_of(id);
    if (mcu.offline()) {
      pausing.not_done(api::Outcome::kLink, "MCU " + mcu.name() + " was lost, and the program of " +
                                                motor.name() + " may go on without a host");
    }
    return mcu.offline();
  }
  if (motor.stands_paused() || motor.is<motion::InProgram>()) {
    ++pausing.paused;
    return true;
  }
  if (motor.is_paused() || (motor.moves() && motor.stops())) return false;
  if (pausing.stopping.contains(id)) return true;
  const char* how = motor.moves()                      ? "going on by a later request"
                    : motor.position_steps() == target ? "at their targets"
                                                       : "stopped";
  pausing.left[how].push_back(id);
  return true;
}

std::string Pauses::text_of_left(const Pausing& pausing) const {
  constexpr std::size_t kMostNamed = 8;
  std::string text;
  for (const auto& [what, motors] : pausing.left) {
    text += "; not paused, " + what + ":";
    for (std::size_t i = 0; i < std::min(motors.size(), kMostNamed); ++i) {
      text += " " + installation_[motors[i]].name();
    }
    if (motors.size() > kMostNamed) {
      text += " and " + std::to_string(motors.size() - kMostNamed) + " more";
    }
  }
  return text;
}

void Pauses::step(std::int64_t) {
  open_pauses_.follow([this](Pausing& pausing) {
    std::erase_if(pausing.motors,
                  [&](const auto& motor) { return has_ended(pausing, motor.first, motor.second); });
    if (!pausing.motors.empty()) return false;
    pausing.asker.answer(api::Completed{.outcome = pausing.outcome,
                                        .reason = "paused: " + count_text(pausing.paused) +
                                                  text_of_left(pausing) + pausing.problems,
                                        .detail = {}});
    return true;
  });
}

}  // namespace bushd::daemon
