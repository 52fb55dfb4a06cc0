#include "daemon/services/pauses.h"

#include <utility>

namespace bushd::daemon {
namespace {

std::string count_text(std::size_t motors) {
  return std::to_string(motors) + (motors == 1 ? " motor" : " motors");
}

}  // namespace

Pauses::Pauses(Installation& installation, Interlocks& interlocks, Moves& moves,
               OpenMoves& open_moves)
    : installation_(installation), interlocks_(interlocks), moves_(moves), open_(open_moves) {
  interlocks_.add([this](MotorId motor) -> Result<void> {
    if (!installation_[motor].is_held()) return {};
    return fail("it is held; run 'bushctl release NAME'");
  });
}

void Pauses::request(std::int64_t now_us, const api::Asker& asker, const api::Pause& request) {
  const auto motors = installation_.find_with_groups(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  for (const MotorId motor : *motors) {
    if (!installation_[motor].follows()) continue;
    return asker.answer(api::Refused{
        installation_[motor].name() +
        " follows an array, whose times go on: stop it, and follow the rest of the rows from "
        "where its motors stand"});
  }
  asker.answer(api::Accepted{});
  std::vector<MotorId> moving;
  std::vector<MotorId> jogs;
  for (const MotorId motor : installation_.with_lines(*motors)) {
    if (!installation_[motor].moves()) continue;
    const bool jogs_on = open_.jogs(motor);
    if (jogs_on) {
      open_.say(motor, api::Outcome::kStopped,
                {api::Outcome::kStopped, "ended, because " + text_of(asker) + " paused it"});
    }
    (jogs_on ? jogs : moving).push_back(motor);
  }
  moves_.pause(now_us, moving);
  moves_.stop(now_us, jogs);
  if (open_pauses_.size() >= kMaxOpen) {
    open_pauses_.front().asker.answer(api::done("carried out; its end is not waited for"));
    open_pauses_.pop_front();
  }
  open_pauses_.push_back({.asker = asker, .motors = moving, .paused = moving.size()});
}

void Pauses::request(std::int64_t now_us, const api::Asker& asker, const api::Resume& request) {
  const auto motors = installation_.find_with_groups(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  if (const auto may = interlocks_.may_move(); !may) {
    return asker.answer(api::Refused{may.error().text()});
  }
  std::vector<MotorId> paused;
  for (const MotorId motor : installation_.with_lines(*motors)) {
    if (!installation_[motor].is_paused()) continue;
    if (const auto may = interlocks_.may_move(motor); !may) {
      return asker.answer(api::Refused{installation_[motor].name() + ": " + may.error().text()});
    }
    paused.push_back(motor);
  }
  asker.answer(api::Accepted{});
  moves_.resume(now_us, paused);
  installation_.changed = true;
  asker.answer(api::done("resumed: " + count_text(paused.size())));
}

void Pauses::request(std::int64_t, const api::Asker& asker, const api::Hold& request) {
  hold(asker, request.motors, true);
}

void Pauses::request(std::int64_t, const api::Asker& asker, const api::Release& request) {
  hold(asker, request.motors, false);
}

void Pauses::hold(const api::Asker& asker, const api::MotorNames& names, bool held) {
  const auto motors = installation_.find_with_groups(names);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  for (const MotorId motor : *motors) installation_[motor].hold(held);
  installation_.changed = true;
  asker.answer(api::done((held ? "held: " : "released: ") + count_text(motors->size())));
}

void Pauses::step(std::int64_t) {
  std::erase_if(open_pauses_, [this](Pausing& pausing) {
    std::erase_if(pausing.motors, [this](MotorId id) {
      const motion::Motor& motor = installation_[id];
      return !motor.is_paused() || motor.stands_paused();
    });
    if (!pausing.motors.empty()) return false;
    pausing.asker.answer(api::done("paused: " + count_text(pausing.paused)));
    return true;
  });
}

}  // namespace bushd::daemon
