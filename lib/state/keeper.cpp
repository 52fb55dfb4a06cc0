#include "state/keeper.h"

#include <algorithm>
#include <utility>

namespace bushd::state {
namespace {

void keep_newest(std::vector<PastMove>& moves) {
  constexpr std::ptrdiff_t kAtOnce = Keeper::kMaxPendingMoves / 10;  // not all moved up for each
  const std::ptrdiff_t many = std::ssize(moves) - Keeper::kMaxPendingMoves;
  if (many > 0) moves.erase(moves.begin(), moves.begin() + std::max(many, kAtOnce));
}

bool same_but_time(Record a, const Record& b) {
  a.utime_us = b.utime_us;
  return a == b;
}

}  // namespace

Keeper::Keeper(const std::vector<std::string>& motors, const std::map<std::string, Kept>& kept,
               Backend& backend)
    : backend_(backend) {
  for (const std::string& name : motors) {
    Motor motor{.name = name, .kept = {}};
    if (const auto found = kept.find(name); found != kept.end()) motor.kept = found->second;
    motor.on_disk = motor.kept.motion;
    motor.ended = stood(motor.kept) ? motor.kept.motion : 0;
    // Nothing is known of its motions; the next one has another number in any case.
    if (!motor.kept.record) motor.ended = motor.kept.motion;
    motors_.add(std::move(motor));
  }
}

bool Keeper::marked(MotorId id) const {
  const Motor& motor = motors_[id];
  return motor.on_disk == motor.kept.motion && motor.ended < motor.kept.motion;
}

Result<void> Keeper::want_mark(std::int64_t now_us, MotorId id) {
  Motor& motor = motors_[id];
  if (marked(id)) {
    // Of a rest that has not gone out yet nobody learns.
    if (motor.kept.record && motor.kept.record->motion == motor.kept.motion) {
      motor.kept.record->at_rest = false;
      pending_.records[motor.name] = *motor.kept.record;
    }
    return {};
  }
  if (motor.wanted_us) {
    if (now_us - *motor.wanted_us < kPatienceUs) return {};
    return fail("its moving mark is not on the disk after " +
                std::to_string(kPatienceUs / 1'000'000) + " s");
  }
  if (mark_error_ && now_us < mark_again_us_) return fail(*mark_error_);
  // One that was never granted, and of whose end the disk cannot know, is as good as a new one.
  if (motor.on_disk == motor.kept.motion || motor.ended >= motor.kept.motion) {
    motor.kept.motion = std::max(motor.kept.motion, motor.ended) + 1;
  }
  motor.wanted_us = now_us;
  if (std::ranges::find(to_mark_, id) == to_mark_.end()) to_mark_.push_back(id);
  return {};
}

void Keeper::give_up_mark(MotorId id) {
  motors_[id].unguarded = true;
  motors_[id].kept.mark_lost = true;
}

bool Keeper::any_unguarded() const {
  return std::ranges::any_of(motors_, &Motor::unguarded);
}

void Keeper::tell(Motor& motor, Record record) {
  ++told_;
  motor.kept.record = record;
  pending_.records[motor.name] = std::move(record);
}

void Keeper::stands(MotorId id, Record record) {
  Motor& motor = motors_[id];
  record.at_rest = true;
  record.motion = motor.kept.motion;
  motor.kept.mark_lost = motor.unguarded;
  const bool same = motor.kept.record && same_but_time(*motor.kept.record, record);
  if (same && !motor.unguarded) return;
  tell(motor, std::move(record));
}

void Keeper::moves(MotorId id, Record record) {
  Motor& motor = motors_[id];
  record.at_rest = false;
  record.motion = motor.kept.record ? motor.kept.record->motion : 0;
  if (motor.kept.record && same_but_time(*motor.kept.record, record)) return;
  tell(motor, std::move(record));
}

void Keeper::settings(MotorId id, Settings settings) {
  ++told_;
  pending_.settings[motors_[id].name] = settings;
  motors_[id].kept.settings = std::move(settings);
}

void Keeper::settings(const std::string& name, Settings settings) {
  ++told_;
  pending_.settings[name] = std::move(settings);
}

void Keeper::past(PastMove move) {
  ++told_;
  pending_.moves.push_back(std::move(move));
  keep_newest(pending_.moves);
}

void Keeper::step(std::int64_t now_us) {
  if (marking_.empty() && !to_mark_.empty() && now_us >= mark_again_us_) {
    std::vector<Mark> marks;
    for (const MotorId id : std::exchange(to_mark_, {})) {
      marks.push_back({.motor = motors_[id].name, .motion = motors_[id].kept.motion});
      marking_.emplace_back(id, motors_[id].kept.motion);
    }
    backend_.mark(std::move(marks));
  }
  if (!writing_ && !pending_.empty() && now_us >= write_again_us_) {
    writing_ = std::exchange(pending_, {});
    writing_up_to_ = told_;
    for (Motor& motor : motors_) {
      const auto record = writing_->records.find(motor.name);
      if (record == writing_->records.end() || !record->second.at_rest) continue;
      motor.ended = std::max(motor.ended, record->second.motion);
    }
    backend_.write(*writing_);
  }
}

std::int64_t Keeper::next_wake_us() const {
  const bool marks = marking_.empty() && !to_mark_.empty();
  const bool writes = !writing_ && !pending_.empty();
  return std::min(marks ? mark_again_us_ : INT64_MAX, writes ? write_again_us_ : INT64_MAX);
}

// What has failed is tried again though nobody may want it any more: the number in the slot and
// that in the record come to agree.
void Keeper::mark(std::int64_t now_us, const Result<void>& done) {
  for (const auto& [id, motion] : std::exchange(marking_, {})) {
    Motor& motor = motors_[id];
    if (done) motor.on_disk = motion;
    if (!done || motion == motor.kept.motion) motor.wanted_us.reset();
    if (done || std::ranges::find(to_mark_, id) != to_mark_.end()) continue;
    to_mark_.push_back(id);
  }
  mark_error_.reset();
  mark_again_us_ = 0;
  if (done) return;
  mark_error_ = done.error().text();
  mark_again_us_ = now_us + kRetryUs;
}

void Keeper::write(std::int64_t now_us, const Result<void>& done) {
  Batch written = std::move(*std::exchange(writing_, std::nullopt));
  trouble_.reset();
  write_again_us_ = 0;
  if (done) {
    kept_up_to_ = writing_up_to_;
    for (Motor& motor : motors_) {
      const auto record = written.records.find(motor.name);
      if (record != written.records.end() && record->second.at_rest) motor.unguarded = false;
    }
    return;
  }
  trouble_ = done.error().text();
  write_again_us_ = now_us + kRetryUs;
  // What has been told since is newer.
  pending_.records.merge(written.records);
  pending_.settings.merge(written.settings);
  written.moves.insert(written.moves.end(), pending_.moves.begin(), pending_.moves.end());
  pending_.moves = std::move(written.moves);
  keep_newest(pending_.moves);
}

}  // namespace bushd::state
