#include "daemon/services/kept_positions.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/output_bits.h"
#include "base/units/ratio.h"
#include "bus/rs485/unique_id.h"
#include "daemon/services/allowed.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {
namespace {

constexpr std::int64_t kSeenPeriodUs = 1'000'000;
constexpr int kMostReading = 16;  // anybody may ask for a history

// "" of a motor without a unit: its positions are steps.
std::string scale_text(const motion::Motor& motor) {
  const units::Coordinates& coordinates = motor.scale().coordinates();
  return coordinates.has_unit() ? units::to_text(coordinates.scale().steps_per_unit)
                                : std::string();
}

state::Trust trust_of(const motion::Motor& motor) {
  if (motor.trust().uncertain_reason()) return state::Trust::kUncertain;
  if (motor.trust().restored_reason()) return state::Trust::kRestored;
  return motor.trust().confirmed() ? state::Trust::kKnown : state::Trust::kUnconfirmed;
}

}  // namespace

KeptPositions::KeptPositions(Installation& installation, const Positions& positions,
                             Journal& journal, Outputs& outputs)
    : installation_(installation), positions_(positions), journal_(journal), outputs_(outputs) {
  for ([[maybe_unused]] const MotorId motor : installation.motors()) motors_.add();
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) mcus_.add();
}

void KeptPositions::use(const std::map<std::string, state::Kept>& kept, state::Backend& backend,
                        bool required) {
  std::vector<std::string> names;
  for (const MotorId motor : installation_.motors()) names.push_back(installation_[motor].name());
  keeper_.emplace(names, kept, backend);
  backend_ = &backend;
  required_ = required;
  for (const auto& [name, of_name] : kept) {
    if (std::ranges::find(names, name) == names.end()) others_[name] = of_name.settings;
  }
  if (in_use_) in_use_();
}

state::Settings KeptPositions::settings(MotorId id) const {
  return keeper_ ? keeper_->kept(id).settings : state::Settings();
}

void KeptPositions::keep(MotorId id, state::Settings settings) {
  if (keeper_ && settings != keeper_->kept(id).settings) keeper_->settings(id, std::move(settings));
}

state::Settings KeptPositions::settings(const std::string& name) const {
  const auto found = others_.find(name);
  return found != others_.end() ? found->second : state::Settings();
}

void KeptPositions::keep(const std::string& name, const state::Settings& settings) {
  if (!keeper_ || others_[name] == settings) return;
  others_[name] = settings;
  keeper_->settings(name, settings);
}

void KeptPositions::marked(std::int64_t now_us, const Result<void>& done) {
  keeper_->mark(now_us, done);
}

void KeptPositions::written(std::int64_t now_us, const Result<void>& done) {
  keeper_->write(now_us, done);
}

Result<void> KeptPositions::may_be_confirmed(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  if (auto online = installation_.mcu_of(id).must_be_online(); !online) return online;
  if (!motor.is<motion::Resting>()) {
    return fail(motion::busy_text(motor) + "; its position can be confirmed at rest only");
  }
  if (!being_restored(id) && !positions_.counter_being_set(id)) return {};
  return fail(motor.name() + ": its position is being set; wait for that result");
}

void KeptPositions::request(const api::Asker& asker, const api::Confirm& request) {
  const auto motors = installation_.find(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  for (const MotorId id : *motors) {
    if (const auto may = may_be_confirmed(id); !may) {
      return asker.answer(api::Refused{may.error().text()});
    }
  }
  asker.answer(api::Accepted{});
  for (const MotorId id : *motors) {
    motion::Motor& motor = installation_[id];
    const std::string who = text_of(asker);
    motor.trust().is_known();
    outputs_.log(LogLevel::kInfo, id,
                 motor.name() + ": position " + std::to_string(motor.position_steps()) +
                     " confirmed by " + who);
    past({.motor = motor.name(),
          .what = "confirm",
          .who = who,
          .from_steps = motor.position_steps(),
          .to_steps = motor.position_steps(),
          .result = std::string(api::word(api::Outcome::kDone))});
    keep_confirmed(id);
  }
  installation_.changed = true;
  answer_when_kept(asker, api::done("done"));
}

void KeptPositions::keep_confirmed(MotorId id) {
  if (!keeper_) return;
  const state::Record record = record_of(installation_.mcu_of(id), id);
  // What is about to move does not stand any more.
  if (motors_[id].wanted) return keeper_->moves(id, record);
  keeper_->stands(id, record);
}

void KeptPositions::keep_uncertain(MotorId id) {
  if (!keeper_ || !keeper_->kept(id).record) return;
  state::Record record = *keeper_->kept(id).record;
  record.trust = state::Trust::kUncertain;
  record.reason = *installation_[id].trust().uncertain_reason();
  if (record.at_rest) return keeper_->stands(id, std::move(record));
  keeper_->moves(id, std::move(record));
}

void KeptPositions::answer_when_kept(const api::Asker& asker, api::Completed done) {
  if (!keeper_) return asker.answer(done);
  open_.push_back({asker, std::move(done)});
}

void KeptPositions::answer_open(std::int64_t now_us) {
  std::erase_if(open_, [&](Open& open) {
    if (!open.number) open.number = keeper_->told();
    if (!open.until_us) open.until_us = now_us + kAnswerUs;
    const bool kept = keeper_->kept_up_to() >= *open.number;
    if (!kept && now_us < *open.until_us) return false;
    if (!kept) {
      open.done.outcome = api::Outcome::kFault;
      open.done.reason += "; this counts, but is not on the disk, so it is lost if bushd ends: " +
                          keeper_->trouble().value_or("the disk does not answer") +
                          ". It is tried again; 'bushctl doctor' tells of the disk";
    }
    open.asker.answer(open.done);
    return true;
  });
}

void KeptPositions::request(const api::Asker& asker, const api::GetHistory& request) {
  const auto motor = installation_.find(request.motor);
  if (!motor) return asker.answer(api::Refused{motor.error().text()});
  if (!api::GetHistory::kMost.has(request.most)) {
    return asker.answer(api::Refused{std::to_string(request.most) + " lines of history" +
                                     allowed(api::GetHistory::kMost)});
  }
  if (!keeper_) {
    return asker.answer(
        api::Refused{"nothing is kept, so there is no history; see [state] in bushd.toml"});
  }
  if (reading_ >= kMostReading) {
    return asker.answer(
        api::Refused{"too many requests for histories wait; try again in a moment"});
  }
  ++reading_;
  backend_->history(
      request.motor, request.most,
      [this, asker](const Result<std::vector<state::PastMove>>& found) {
        --reading_;
        if (!found) return asker.answer(api::Refused{found.error().text()});
        api::MotionHistory history;
        for (const state::PastMove& move : *found) {
          history.motions.push_back({.utime_us = move.utime_us,
                                     .what = move.what,
                                     .who = move.who,
                                     .from_steps = move.from_steps,
                                     .to_steps = move.to_steps,
                                     .outcome = move.result,
                                     .reason = move.reason,
                                     .from_text = move.from_text,
                                     .to_text = move.to_text});
        }
        asker.answer(api::Accepted{});
        asker.answer(api::Completed{
            .outcome = api::Outcome::kDone, .reason = "done", .detail = std::move(history)});
      });
}

Result<bool> KeptPositions::make_ready(std::int64_t now_us, MotorId id) {
  if (!keeper_) return true;
  Motor& motor = motors_[id];
  motor.wanted = true;
  if (motor.restoring) return false;
  tell_counter(id);
  const auto wanted = keeper_->want_mark(now_us, id);
  if (wanted) return keeper_->marked(id);
  if (required_) {
    return fail("the disk cannot be told that it moves: " + wanted.error().text() +
                ". Make room, or repair the disk; with [state] required = false it moves in spite "
                "of that");
  }
  keeper_->give_up_mark(id);
  return true;
}

// By which counter it moves, and how that is read, before it does.
void KeptPositions::tell_counter(MotorId id) {
  const Mcu& mcu = installation_.mcu_of(id);
  if (!mcu.online()) return;
  const state::Record now = record_of(mcu, id);
  const std::optional<state::Record>& kept = keeper_->kept(id).record;
  const bool told =
      kept && state::same_counter(*kept, now) && kept->steps_per_unit == now.steps_per_unit;
  if (!told) keeper_->moves(id, now);
}

void KeptPositions::past(state::PastMove move) {
  if (!keeper_) return;
  move.utime_us = outputs_.wall_clock_us();
  const auto motor = installation_.find(move.motor);
  if (motor && installation_[*motor].scale().coordinates().has_unit()) {
    const units::Coordinates& coordinates = installation_[*motor].scale().coordinates();
    if (move.from_text.empty()) move.from_text = coordinates.text(move.from_steps);
    if (move.to_text.empty()) move.to_text = coordinates.text(move.to_steps);
  }
  keeper_->past(std::move(move));
}

bool KeptPositions::settled() const {
  if (!keeper_ || keeper_->trouble()) return true;
  return open_.empty() && keeper_->kept_up_to() == keeper_->told();
}

void KeptPositions::goes_online(Mcu& mcu) {
  if (!keeper_) return;
  const Heard heard{.unique_id = link::unique_id_text(mcu.view().identity),
                    .boot_number = mcu.report().boot_number};
  const auto before = std::exchange(mcus_[mcu.id].heard, heard);
  // What this daemon has followed itself it knows better.
  if (before == heard) return;
  for (const MotorId id : mcu.motors()) {
    if (installation_[id].output().value < mcu.report().motor_count) {
      connect(mcu, id, !before.has_value());
    }
  }
}

state::Seen KeptPositions::seen(const Mcu& mcu, MotorId id) const {
  const motion::Motor& motor = installation_[id];
  const Heard& heard = *mcus_[mcu.id].heard;
  const bool at_limit =
      has_bit(mcu.report().forbidden_positive | mcu.report().forbidden_negative, motor.output());
  auto before = keeper_->other_at(id, heard.unique_id, motor.output().value);
  const std::optional<state::Record>& kept = keeper_->kept(id).record;
  const state::Record* told = before ? &before->record : kept ? &*kept : nullptr;
  const bool has_text = told != nullptr && told->steps_per_unit == scale_text(motor) &&
                        motor.scale().coordinates().has_unit();
  std::string text = has_text ? motor.scale().coordinates().text(told->steps) : std::string();
  return {.mcu = mcu.name(),
          .unique_id = heard.unique_id,
          .boot_number = heard.boot_number,
          .output = motor.output().value,
          .steps_per_unit = scale_text(motor),
          .steps = motor.position_steps(),
          .before = std::move(before),
          .position_text = std::move(text),
          .local = installation_.drives()[id].moved_by_people(),
          .may_have_overrun =
              at_limit && installation_.config()[id].limit_action == BUSHD_STOP_IMMEDIATE};
}

void KeptPositions::note_unmoved(MotorId id, const state::Seen& seen,
                                 const state::Verdict& verdict) {
  std::optional<Unmoved>& unmoved = motors_[id].unmoved;
  unmoved.reset();
  if (verdict.trust != state::Trust::kUncertain) return;
  const std::int64_t steps = verdict.set_steps.value_or(seen.steps);
  const Unmoved now{.record = {}, .steps = steps, .reason = verdict.reason};
  if (seen.before) {
    unmoved = now;
    return;
  }
  const state::Kept& kept = keeper_->kept(id);
  if (!kept.record || kept.record->steps_per_unit == seen.steps_per_unit) return;
  state::Seen as_before = seen;
  as_before.steps_per_unit = kept.record->steps_per_unit;
  const state::Verdict with_it = state::on_connecting(kept, as_before);
  if (with_it.trust == state::Trust::kUncertain) return;
  unmoved = now;
  unmoved->record = kept.record;
  unmoved->record->trust = with_it.trust;
  unmoved->record->reason = with_it.reason;
  unmoved->record->boot_number = seen.boot_number;
  unmoved->record->steps = steps;
}

void KeptPositions::connect(Mcu& mcu, MotorId id, bool first) {
  motion::Motor& motor = installation_[id];
  const state::Seen seen = this->seen(mcu, id);
  state::Verdict verdict = state::on_connecting(keeper_->kept(id), seen);
  note_unmoved(id, seen, verdict);
  // What the MCU itself reports of before this daemon.
  if (first && motor.trust().uncertain_reason() && verdict.trust != state::Trust::kUncertain) {
    verdict.trust = state::Trust::kUncertain;
    verdict.reason = *motor.trust().uncertain_reason();
  }
  take(id, verdict);
  if (!verdict.set_steps) return ask_for_kept(id);
  motors_[id].restoring = Restoring{.steps = *verdict.set_steps, .reason = verdict.reason};
  motor.trust().restoring(true);
  mcu.bus().set_position(mcu.on_bus(), motor.output().value,
                         static_cast<std::int32_t>(*verdict.set_steps));
}

// Where it stands, or was bound for, is where it was told to go.
void KeptPositions::ask_for_kept(MotorId id) {
  motion::Motor& motor = installation_[id];
  const std::optional<state::Record>& kept = keeper_->kept(id).record;
  if (!kept || kept->target_parts == 0 || motor.trust().uncertain_reason()) return;
  motor.ask_for(units::Steps{kept->target_steps, kept->target_parts});
}

void KeptPositions::take(MotorId id, const state::Verdict& verdict) {
  motion::Motor& motor = installation_[id];
  switch (verdict.trust) {
    case state::Trust::kUnconfirmed:
      motor.trust().is_unconfirmed();
      break;
    case state::Trust::kKnown:
      motor.trust().is_known();
      break;
    case state::Trust::kRestored:
      motor.trust().is_restored(verdict.reason);
      break;
    case state::Trust::kUncertain:
      motor.trust().is_uncertain(verdict.reason);
      outputs_.log(LogLevel::kWarning, id, motor.name() + ": is uncertain: " + verdict.reason);
      break;
  }
  installation_.changed = true;
}

// What people may have read of its motion last, and confirm.
void KeptPositions::keep_heard(const Mcu& mcu) {
  const std::optional<Heard>& heard = mcus_[mcu.id].heard;
  if (!keeper_ || !heard) return;
  for (const MotorId id : mcu.motors()) {
    const std::optional<state::Record>& kept = keeper_->kept(id).record;
    if (!kept || being_restored(id) || positions_.counter_being_set(id)) continue;
    const motion::Motor& motor = installation_[id];
    state::Record record = *kept;
    record.steps = motor.position_steps();
    record.utime_us =
        motion::position_trust(motor, {}).heard_utime_us.value_or(outputs_.wall_clock_us());
    const bool is_its_own = state::same_counter(record, {.unique_id = heard->unique_id,
                                                         .output = motor.output().value}) &&
                            record.boot_number == heard->boot_number;
    if (is_its_own && record.steps != kept->steps) keeper_->moves(id, std::move(record));
  }
}

void KeptPositions::goes_offline(Mcu& mcu, const std::string&) {
  keep_heard(mcu);
  for (const MotorId id : mcu.motors()) {
    // It begins again when the MCU is back.
    if (!std::exchange(motors_[id].restoring, std::nullopt)) continue;
    installation_[id].trust().restoring(false);
    mcus_[mcu.id].heard.reset();
  }
}

void KeptPositions::reports(std::int64_t, Mcu& mcu) {
  if (keeper_) mcus_[mcu.id].reported = true;
}

void KeptPositions::follow_restoring(const Mcu& mcu, MotorId id) {
  if (mcu.busy()) return;
  motion::Motor& motor = installation_[id];
  const Restoring restoring = *std::exchange(motors_[id].restoring, std::nullopt);
  motor.trust().restoring(false);
  installation_.changed = true;
  if (motor.position_steps() != restoring.steps) {
    motor.trust().is_uncertain("MCU " + mcu.name() + " did not take its kept position of " +
                               std::to_string(restoring.steps) + " steps");
    outputs_.log(LogLevel::kError, id, motor.name() + ": " + *motor.trust().uncertain_reason());
    return;
  }
  journal_.position_set(id, 0, {});
  ask_for_kept(id);
  if (motor.trust().restored_reason()) {
    outputs_.log(LogLevel::kInfo, id,
                 motor.name() + ": position " + std::to_string(restoring.steps) +
                     " is restored: " + restoring.reason);
  }
}

void KeptPositions::step(std::int64_t now_us) {
  if (!keeper_) return;
  // After the other services: what a report has ended is over.
  for (const McuId id : installation_.mcus()) {
    const Mcu& mcu = installation_[id];
    if (!std::exchange(mcus_[id].reported, false) || !mcu.online()) continue;
    for (const MotorId motor : mcu.motors()) {
      if (installation_[motor].output().value >= mcu.report().motor_count) continue;
      if (motors_[motor].restoring) {
        follow_restoring(mcu, motor);
      } else {
        keep(now_us, mcu, motor);
      }
    }
  }
  keeper_->step(now_us);
  tell_trouble();
  answer_open(now_us);
}

void KeptPositions::keep(std::int64_t now_us, const Mcu& mcu, MotorId id) {
  const motion::Motor& motor = installation_[id];
  Motor& own = motors_[id];
  if (own.wanted || positions_.counter_being_set(id)) return;
  const bushd_report& report = mcu.report();
  const unsigned may_move = report.moving | report.autonomous | report.armed;
  const bool in_motion = has_bit(may_move, motor.output()) || !motor.is<motion::Resting>();
  if (!in_motion) return keep_at_rest(mcu, id);
  own.unmoved.reset();
  if (now_us - own.seen_us < kSeenPeriodUs) return;
  own.seen_us = now_us;
  keeper_->moves(id, record_of(mcu, id));
}

void KeptPositions::keep_at_rest(const Mcu& mcu, MotorId id) {
  std::optional<Unmoved>& unmoved = motors_[id].unmoved;
  state::Record record = record_of(mcu, id);
  const bool as_before =
      unmoved && record.steps == unmoved->steps &&
      installation_[id].trust().uncertain_reason() == unmoved->reason &&
      // Whose position it was may have gone to another output: then nobody else keeps it.
      (unmoved->record || keeper_->other_at(id, record.unique_id, record.output));
  if (!as_before) {
    unmoved.reset();
    keeper_->stands(id, std::move(record));
  } else if (unmoved->record) {
    keeper_->stands(id, *unmoved->record);
  }
}

state::Record KeptPositions::record_of(const Mcu& mcu, MotorId id) const {
  const motion::Motor& motor = installation_[id];
  const units::Steps asked_for = motor.asked_for().value_or(units::Steps{});
  const bool is_whole = asked_for.parts == 0;
  return {.steps = motor.position_steps(),
          .steps_per_unit = scale_text(motor),
          .trust = trust_of(motor),
          .reason = motor.trust().uncertain_reason() ? *motor.trust().uncertain_reason()
                                                     : motor.trust().restored_reason().value_or(""),
          .utime_us = outputs_.wall_clock_us(),
          .target_steps = is_whole ? 0 : asked_for.whole,
          .target_parts = asked_for.parts,
          .unique_id = mcus_[mcu.id].heard->unique_id,
          .boot_number = mcus_[mcu.id].heard->boot_number,
          .output = motor.output().value};
}

void KeptPositions::tell_trouble() {
  if (told_trouble_ == keeper_->trouble()) return;
  told_trouble_ = keeper_->trouble();
  if (told_trouble_) {
    outputs_.log(LogLevel::kError, {},
                 "positions cannot be kept: " + *told_trouble_ + "; trying again once a second");
  } else {
    outputs_.log(LogLevel::kInfo, {}, "positions are kept again");
  }
}

}  // namespace bushd::daemon
