#include "daemon/services/open_moves.h"

#include <utility>

#include "daemon/model/table_ref.h"

namespace bushd::daemon {

std::string_view word(OpenMoves::Purpose purpose) {
  switch (purpose) {
    case OpenMoves::Purpose::kMove:
      return "move";
    case OpenMoves::Purpose::kHome:
      return "home";
    case OpenMoves::Purpose::kArm:
      return "arm";
    case OpenMoves::Purpose::kJog:
      return "jog";
    case OpenMoves::Purpose::kLine:
      return "line";
    case OpenMoves::Purpose::kTravel:
      return "travel";
    case OpenMoves::Purpose::kFollow:
      return "follow";
    case OpenMoves::Purpose::kProgram:
      return "program";
  }
  return "";
}

void OpenMoves::open(api::Asker asker, const std::vector<MotorId>& motors, Purpose purpose,
                     const tables::TablePtr& by) {
  Open open{.asker = std::move(asker), .purpose = purpose, .tables = {}};
  for (const MotorId motor : motors) {
    open.from_steps[motor] = installation_[motor].position_steps();
    open.tables.push_back(ref_to(by ? *by : *installation_.table_of(motor)));
  }
  open_.emplace(book_.open(motors), std::move(open));
}

void OpenMoves::tell(MotorId id, api::Outcome outcome, const std::string& reason) const {
  const auto move = book_.move_of(id);
  if (!listener_ || !move) return;
  const Open& open = open_.at(*move);
  listener_({.motor = id,
             .purpose = open.purpose,
             .asker = open.asker,
             .from_steps = open.from_steps.at(id),
             .outcome = outcome,
             .reason = reason});
}

void OpenMoves::planned(MotorId motor, int legs, double most_steps_per_s) {
  const auto move = book_.move_of(motor);
  if (move) open_.at(*move).plans[motor] = {legs, most_steps_per_s};
}

void OpenMoves::say(MotorId motor, api::Outcome outcome, Saying saying) {
  const auto move = book_.move_of(motor);
  if (move) open_.at(*move).sayings.insert_or_assign({motor, outcome}, std::move(saying));
}

void OpenMoves::unsay(MotorId motor, api::Outcome outcome) {
  const auto move = book_.move_of(motor);
  if (move) open_.at(*move).sayings.erase({motor, outcome});
}

void OpenMoves::conclude(MotorId motor, std::function<std::string()> conclusion) {
  const auto move = book_.move_of(motor);
  if (move) open_.at(*move).conclusion = std::move(conclusion);
}

void OpenMoves::stopped_by(const std::vector<MotorId>& motors, const std::string& who) {
  if (book_.empty()) return;
  for (const MotorId motor : motors) {
    if (book_.move_of(motor)) stopped_by_[motor] = who;
  }
}

void OpenMoves::end(MotorId id, api::Outcome outcome, const std::string& why, bool by_plan) {
  installation_.changed = true;
  const auto move = book_.move_of(id);
  if (move && by_plan) {
    if (const auto said = open_.at(*move).sayings.extract({id, outcome})) {
      return end(id, said.mapped().outcome, said.mapped().reason);
    }
  }
  std::string reason = why;
  if (const auto who = stopped_by_.extract(id); who && outcome == api::Outcome::kStopped) {
    reason += ", asked for by " + who.mapped();
  }
  tell(id, outcome, reason);
  const motion::Motor& motor = installation_[id];
  const auto finished = book_.end({.motor = id,
                                   .outcome = outcome,
                                   .position_steps = motor.position_steps(),
                                   .reason = motor.name() + ": " + reason});
  if (!finished) return;
  auto open = open_.extract(finished->move);
  std::vector<api::MotorResult> results;
  for (std::size_t i = 0; i < finished->motors.size(); ++i) {
    const motion::MotorOutcome& part = finished->motors[i];
    results.push_back(
        result_of(part.motor, part.outcome, part.position_steps, open.mapped().asker));
    results.back().table = open.mapped().tables[i];
    results.back().legs = open.mapped().plans[part.motor].legs;
    results.back().most_steps_per_s = open.mapped().plans[part.motor].most_steps_per_s;
  }
  const auto& conclusion = open.mapped().conclusion;
  open.mapped().asker.answer(
      api::Completed{.outcome = finished->outcome,
                     .reason = finished->reason + (conclusion ? conclusion() : std::string()),
                     .detail = std::move(results)});
}

api::MotorResult OpenMoves::result_of(MotorId id, api::Outcome outcome, std::int64_t position_steps,
                                      const api::Asker& asker) const {
  const units::Coordinates& coordinates = installation_[id].scale().coordinates();
  return {.motor = installation_[id].name(),
          .outcome = outcome,
          .position_steps = position_steps,
          .user = coordinates.user_of(position_steps),
          .dial = coordinates.dial_of(position_steps),
          .unit = coordinates.unit(),
          .precision = coordinates.precision(),
          .table = ref_to(*installation_.table_of(id)),
          .who = text_of(asker)};
}

void OpenMoves::not_begun(const api::Asker& asker, const Precedence::Overtaken& overtaken) const {
  std::vector<api::MotorResult> results;
  for (const MotorId motor : overtaken.of) {
    results.push_back(
        result_of(motor, api::Outcome::kStopped, installation_[motor].position_steps(), asker));
  }
  asker.answer(api::Completed{.outcome = api::Outcome::kStopped,
                              .reason = installation_[overtaken.motor].name() + ": stopped by " +
                                        overtaken.by +
                                        " before this was carried out; nothing has moved",
                              .detail = std::move(results)});
}

const api::Asker* OpenMoves::asker_of(MotorId motor) const {
  const auto move = book_.move_of(motor);
  return move ? &open_.at(*move).asker : nullptr;
}

std::string OpenMoves::asked_for_by(MotorId motor) const {
  const api::Asker* asker = asker_of(motor);
  return asker == nullptr ? "" : ", asked for by " + text_of(*asker);
}

}  // namespace bushd::daemon
