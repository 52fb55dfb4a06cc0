#include "daemon/services/holds.h"

#include <utility>

#include "daemon/model/count_text.h"
#include "state/rules.h"
#include "words/remedy.h"

namespace bushd::daemon {

Holds::Holds(Installation& installation, Interlocks& interlocks, Moves& moves,
             LocalInputs& local_inputs, OpenMoves& open_moves, KeptPositions& kept,
             Outputs& outputs)
    : installation_(installation),
      moves_(moves),
      local_inputs_(local_inputs),
      open_moves_(open_moves),
      kept_(kept),
      outputs_(outputs) {
  interlocks.add([this](MotorId id) -> Result<void> {
    const motion::Motor& motor = installation_[id];
    if (!motor.hold().is_set()) return {};
    return fail(motor.hold().text() + "; run " + words::remedy("release", motor.name()));
  });
}

void Holds::take_kept() {
  for (const MotorId id : installation_.motors()) {
    const state::Settings kept = kept_.settings(id);
    const auto found = kept.find(state::kHeldKey);
    if (found == kept.end()) continue;
    motion::Motor& motor = installation_[id];
    motor.hold().set(found->second.value);
    outputs_.log(LogLevel::kInfo, id,
                 motor.name() + ": " + motor.hold().text() + "; run " +
                     words::remedy("release", motor.name()));
  }
  for (auto& [name, settings] : kept_.settings_of_others()) {
    const auto found = settings.find(state::kHeldKey);
    if (found == settings.end()) continue;
    outputs_.log(LogLevel::kWarning, {},
                 name + " is not configured any more; it was held " + found->second.value +
                     ", which is dropped");
    settings.erase(found);
    kept_.keep(name, settings);
  }
  installation_.changed = true;
}

void Holds::keep(MotorId id) {
  state::Settings settings = kept_.settings(id);
  settings.erase(state::kHeldKey);
  const motion::Motor& motor = installation_[id];
  if (motor.hold().is_set()) settings[state::kHeldKey] = {.value = *motor.hold().how()};
  kept_.keep(id, std::move(settings));
}

void Holds::note(MotorId id, const char* what, const api::Asker& by) {
  const motion::Motor& motor = installation_[id];
  kept_.past({.motor = motor.name(),
              .what = what,
              .who = text_of(by),
              .from_steps = motor.position_steps(),
              .to_steps = motor.position_steps(),
              .result = std::string(api::word(api::Outcome::kDone))});
}

// Who was first has it held: a release is for all of them.
void Holds::hold(MotorId id, const api::Asker& by) {
  motion::Motor& motor = installation_[id];
  if (motor.hold().is_set()) return;
  motor.hold().set("by " + (by.session ? by.session->text() : "the daemon") + " since " +
                   state::time_text(outputs_.wall_clock_us()));
  keep(id);
  note(id, "hold", by);
}

void Holds::release(MotorId id, const api::Asker& by) {
  installation_[id].hold().release();
  keep(id);
  note(id, "release", by);
}

// Those that wait for the trigger would begin by it: they wait no more.
void Holds::request(std::int64_t now_us, const api::Asker& asker, const api::Hold& request) {
  const auto [motors, unknown] = installation_.find_known(request.motors, true);
  if (motors.empty()) return asker.answer(api::Refused{unknown});
  asker.answer(api::Accepted{});
  std::vector<MotorId> armed;
  for (const MotorId motor : motors) {
    hold(motor, asker);
    if (installation_[motor].is<motion::Armed>()) armed.push_back(motor);
  }
  open_moves_.stopped_by(armed, text_of(asker));
  moves_.stop(now_us, armed);
  installation_.changed = true;
  if (open_.size() >= kMostAwaited) {
    const Holding& oldest = open_.front();
    const std::string not_known = oldest.unknown.empty() ? "" : "; " + oldest.unknown;
    kept_.answer_when_kept(
        oldest.asker, {.outcome = not_known.empty() ? api::Outcome::kDone : api::Outcome::kFault,
                       .reason = "held; what their MCUs say is not waited for" + not_known,
                       .detail = {}});
    open_.pop_front();
  }
  open_.push_back({.asker = asker, .motors = motors, .unknown = unknown});
  answer_open();
}

void Holds::request(const api::Asker& asker, const api::Release& request) {
  const auto motors = installation_.find_with_groups(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  std::size_t held = 0;
  for (const MotorId motor : *motors) {
    if (!installation_[motor].hold().is_set()) continue;
    release(motor, asker);
    ++held;
  }
  installation_.changed = true;
  kept_.answer_when_kept(asker, api::done(held == 0 ? "done; none of them was held"
                                                    : "released: " + count_text(held)));
}

void Holds::answer_open() {
  std::erase_if(open_, [this](const Holding& holding) {
    std::string not_held = holding.unknown.empty() ? "" : "; " + holding.unknown;
    std::string offline;
    for (const MotorId id : holding.motors) {
      const motion::Motor& motor = installation_[id];
      if (!local_inputs_.has_told(id)) return false;
      if (!motor.hold().is_set() || !installation_.drives()[id].moved_by_people()) continue;
      if (const auto refusal = local_inputs_.refusal(id))
        not_held += "; " + motor.name() + ": " + *refusal;
      if (!installation_.mcu_of(id).online()) {
        offline += "; MCU " + installation_.mcu_of(id).name() +
                   " is offline: its local inputs may move " + motor.name() +
                   " until it is online again";
      }
    }
    const std::string text = "held: " + count_text(holding.motors.size()) + not_held + offline;
    kept_.answer_when_kept(
        holding.asker,
        not_held.empty()
            ? api::done(text)
            : api::Completed{.outcome = api::Outcome::kFault, .reason = text, .detail = {}});
    return true;
  });
}

}  // namespace bushd::daemon
