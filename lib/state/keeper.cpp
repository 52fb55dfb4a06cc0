#include "state/keeper.h"

#include <algorithm>
#include <tuple>
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
    motor.record_on_disk = motor.kept.record;
    motors_.add(std::move(motor));
  }
  for (const auto& [name, of_name] : kept) {
    if (!of_name.record || std::ranges::find(motors, name) != motors.end()) continue;
    others_[name] = *of_name.record;
  }
}

std::optional<Owner> Keeper::other_at(MotorId id, const std::string& unique_id,
                                      std::uint8_t output) const {
  const Record counter{.unique_id = unique_id, .output = output};
  for (const Motor& motor : motors_) {
    if (&motor == &motors_[id] || motor.present || !motor.kept.record) continue;
    if (same_counter(*motor.kept.record, counter)) return Owner{motor.name, *motor.kept.record};
  }
  for (const auto& [name, record] : others_) {
    if (same_counter(record, counter)) return Owner{name, record};
  }
  return std::nullopt;
}

bool Keeper::has_mark(const Motor& motor) {
  return motor.on_disk == motor.kept.motion && motor.ended < motor.kept.motion;
}

// The disk knows by which counter it moves, and how that is read: so a name that comes back there
// later does not believe what it had.
bool Keeper::has_counter(const Motor& motor) {
  const auto& [told, there] = std::tie(motor.kept.record, motor.record_on_disk);
  return !told || told->unique_id.empty() ||
         (there && same_counter(*told, *there) && told->steps_per_unit == there->steps_per_unit);
}

bool Keeper::marked(MotorId id) const {
  return has_mark(motors_[id]) && has_counter(motors_[id]);
}

Result<void> Keeper::want_counter(std::int64_t now_us, Motor& motor) {
  if (has_counter(motor)) return {};
  if (!motor.record_wanted_us) motor.record_wanted_us = now_us;
  if (now_us - *motor.record_wanted_us < kPatienceUs) return {};
  return fail(trouble_.value_or("its position is not on the disk after " +
                                std::to_string(kPatienceUs / 1'000'000) + " s"));
}

Result<void> Keeper::want_mark(std::int64_t now_us, MotorId id) {
  Motor& motor = motors_[id];
  if (marked(id)) {
    // Nobody learns of a rest that has not gone out yet.
    if (motor.kept.record && motor.kept.record->motion == motor.kept.motion) {
      motor.kept.record->at_rest = false;
      pending_.records[motor.name] = *motor.kept.record;
    }
    return {};
  }
  if (auto counter = want_counter(now_us, motor); !counter || has_mark(motor)) return counter;
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

// An output is one motor's at a time: a name that had it before does not find its old position
// there when it comes back.
void Keeper::take_output(Motor& motor, const Record& record) {
  const bool has_it = motor.kept.record && same_counter(*motor.kept.record, record);
  if (std::exchange(motor.present, true) && has_it) return;
  if (record.unique_id.empty()) return;
  const auto give_up = [&](const std::string& name, Record& of_name) {
    if (!same_counter(of_name, record)) return;
    give_up_output(of_name, motor.name);
    pending_.records[name] = of_name;
    ++told_;
  };
  for (Motor& other : motors_) {
    // Two that are there have MCUs with the same unique id.
    if (!other.present && other.kept.record) give_up(other.name, *other.kept.record);
  }
  for (auto& [name, of_name] : others_) give_up(name, of_name);
}

void Keeper::tell(Motor& motor, Record record) {
  ++told_;
  motor.kept.record = record;
  pending_.records[motor.name] = std::move(record);
}

void Keeper::stands(MotorId id, Record record) {
  Motor& motor = motors_[id];
  take_output(motor, record);
  record.at_rest = true;
  record.motion = motor.kept.motion;
  motor.kept.mark_lost = motor.unguarded;
  const bool same = motor.kept.record && same_but_time(*motor.kept.record, record);
  if (same && !motor.unguarded) return;
  tell(motor, std::move(record));
}

void Keeper::moves(MotorId id, Record record) {
  Motor& motor = motors_[id];
  take_output(motor, record);
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
      if (record == written.records.end()) continue;
      if (record->second.at_rest) motor.unguarded = false;
      motor.record_on_disk = record->second;
      if (has_counter(motor)) motor.record_wanted_us.reset();
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
