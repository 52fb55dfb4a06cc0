// The bytes of a serial port that makes pulses: which are written when, and which have left.
#include <cstdio>

#include "heritage/serial_pulse/master.h"

namespace bushd::serial_pulse {
namespace {

constexpr std::int64_t kDrainAskUs = 300;
constexpr std::int64_t kLineAskUs = 2'000;  // whether the run of the line is over

}  // namespace

// A driver may stop for a while. What it still had when it was asked has not left; so nothing is
// counted that would have left since.
void SerialPulseMaster::count_gone(std::int64_t now_us) {
  const std::int64_t asked_ns = std::min(now_us, status_us_) * 1000;
  while (sent_.size() > status_->queued && sent_.front().gone_ns <= asked_ns) {
    if (run_) {
      run_->gone += sent_.front().steps;
      run_->left_ns = sent_.front().last_ns;
    }
    sent_.pop_front();
  }
  if (drained(now_us)) recent_.clear();
  while (!recent_.empty() && recent_.front().passed_free_ns &&
         *recent_.front().passed_free_ns + kUnseenUs * 1000 <= asked_ns) {
    recent_.pop_front();
  }
}

// The bytes that the driver has leave one after the other, and none of them before now.
void SerialPulseMaster::follow_queue() {
  if (status_->queued == 0 || status_->baud == 0) return;
  const auto one_ns = static_cast<std::int64_t>(byte_ns(status_->baud));
  const std::int64_t begun_ns = status_us_ * 1000;
  for (std::deque<Sent>* bytes : {&sent_, &recent_}) {
    auto queued = static_cast<std::int64_t>(status_->queued);
    for (auto sent = bytes->rbegin(); sent != bytes->rend() && queued > 0; ++sent, --queued) {
      sent->gone_ns = std::max(sent->gone_ns, begun_ns + queued * one_ns);
    }
  }
  const std::int64_t free_ns = begun_ns + static_cast<std::int64_t>(status_->queued) * one_ns;
  if (free_ns <= line_free_ns_) return;
  add_pause((free_ns - line_free_ns_) / 1000);
  line_free_ns_ = free_ns;
}

// What the driver has no more it may have passed on just now, all at once, however long ago it was
// written: a driver may have stood since it was asked last.
void SerialPulseMaster::follow_passed_on() {
  const std::size_t end = recent_.size() - std::min(status_->queued, recent_.size());
  std::size_t i = end;
  while (i > 0 && !recent_[i - 1].passed_free_ns) --i;
  for (; i < end; ++i) {
    passed_free_ns_ = std::max(passed_free_ns_, status_us_ * 1000) + recent_[i].takes_ns;
    recent_[i].passed_free_ns = passed_free_ns_;
  }
}

// A driver that has nothing, and cannot tell what is behind it, has nothing there from then on.
std::int64_t SerialPulseMaster::drained_us() const {
  return us_of(std::max(line_free_ns_, passed_free_ns_)) + kUnseenUs;
}

bool SerialPulseMaster::drained(std::int64_t now_us) const {
  const std::int64_t free_us = us_of(line_free_ns_);
  if (!sent_.empty() || now_us < free_us || status_us_ < free_us) return false;
  if (status_->queued > 0) return false;
  if (status_->empty) return *status_->empty;
  return now_us >= drained_us();
}

void SerialPulseMaster::wait_until_drained(std::int64_t now_us) {
  const std::int64_t free_us = us_of(line_free_ns_);
  if (status_us_ < free_us) return ask_at(std::max(free_us, now_us));
  if (status_->queued > 0 || status_->empty) return ask_at(now_us + kDrainAskUs);
  wake_at(drained_us());
}

// Since it was asked last the driver may have done nothing.
std::uint32_t SerialPulseMaster::unsure_steps() const {
  std::uint32_t steps = 0;
  for (const Sent& sent : recent_) steps += sent.steps;
  return steps;
}

void SerialPulseMaster::write(std::int64_t now_us, link::PulseOrder& order) {
  if (run_->pace) tell_line(now_us);
  if (run_->ahead.left() == 0 && run_->pace && drained(now_us)) return wake_at(now_us + kLineAskUs);
  if (run_->ahead.left() == 0) return wait_until_drained(now_us);
  if (!may_write(now_us, order)) return;
  while (run_->ahead.left() > 0 && write_byte(now_us, order)) {
  }
  if (run_->ahead.left() == 0) ask_at(us_of(line_free_ns_));
}

// Before its first byte the direction is set, and kept for a while.
bool SerialPulseMaster::may_write(std::int64_t now_us, link::PulseOrder& order) {
  Run& run = *run_;
  const bool positive = run.direction > 0;
  if (status_->positive != positive) {
    if (!drained(now_us)) {
      wait_until_drained(now_us);
    } else if (now_us < us_of(line_free_ns_) + kDirectionUs) {
      wake_at(us_of(line_free_ns_) + kDirectionUs);
    } else if (now_us < direction_due_us_) {
      ask_at(now_us + kDrainAskUs);
    } else {
      order.positive = positive;
      direction_due_us_ = now_us + kDirectionUs;
    }
    return false;
  }
  if (run.hold_us > 0 || run.slow) {
    if (!drained(now_us)) {
      wait_until_drained(now_us);
      return false;
    }
    run.not_before_us = std::max(run.not_before_us, now_us + run.hold_us);
    run.hold_us = 0;
  }
  // It looks before each step, and once more if that is not sure.
  if (run.slow && homing_ && (!looked(now_us) || homing_->readings > 0)) return false;
  const std::int64_t from_us = std::max(run.not_before_us, direction_us_ + kDirectionUs);
  if (now_us >= from_us) return true;
  wake_at(from_us);
  return false;
}

// Returns whether another one may follow at once.
bool SerialPulseMaster::write_byte(std::int64_t now_us, link::PulseOrder& order) {
  Run& run = *run_;
  const auto delays = delays_ahead(run.ahead, planner_.horizon_ns(), Planner::kLookAhead);
  const Ahead ahead{.delays_ns = delays, .to_the_end = delays.size() == run.ahead.left()};
  const Choice choice = planner_.choose(ahead, asked_baud_);
  if (choice.rate.ask != asked_baud_) {
    if (!order.bytes.empty()) return false;
    if (!drained(now_us)) {
      wait_until_drained(now_us);
      return false;
    }
    order.baud = asked_baud_ = choice.rate.ask;
    return false;
  }
  if (run.pace && waits_for_line(now_us)) return false;
  const auto one_ns = static_cast<std::int64_t>(byte_ns(choice.rate.ask));
  const std::int64_t under_way_ns = line_free_ns_ - now_us * 1000;
  const std::int64_t room_ns = std::max(kMostAheadUs * 1000 - one_ns, kSpareUs * 1000);
  if (under_way_ns > room_ns) {
    // Not for each byte that there is room for, and early enough to be late.
    wake_at(us_of(line_free_ns_ - room_ns + std::min(room_ns / 2, kSpareUs * 1000)));
    return false;
  }
  if (burst_us_ && under_way_ns < 0 && run.hold_us == 0 && !run.on_line)
    add_pause(-under_way_ns / 1000);
  if (!burst_us_) burst_us_ = now_us;
  pauses_.bytes_us += one_ns / 1000;
  run.ahead.take_ns();
  const std::int64_t first_ns = run.ahead.time_ns();
  for (unsigned i = 1; i < choice.pattern.steps; ++i) run.ahead.take_ns();
  run.written += choice.pattern.steps;
  order.bytes.push_back(choice.pattern.byte);
  line_free_ns_ = std::max(line_free_ns_, now_us * 1000) + one_ns;
  sent_.push_back({.gone_ns = line_free_ns_,
                   .steps = choice.pattern.steps,
                   .takes_ns = one_ns,
                   .last_step_ns = one_ns * (kBitsPerByte - choice.pattern.after_bits) /
                                   std::int64_t{kBitsPerByte},
                   .first_ns = first_ns,
                   .last_ns = run.ahead.time_ns()});
  recent_.push_back(sent_.back());
  const std::uint64_t after_ns = choice.pattern.after_bits * std::uint64_t{1'000'000'000};
  run.kept_ns = after_ns / choice.rate.most;
  if (choice.then_wait && delays.size() > 1) {
    run.hold_us = hold_us_of(delays[1], run.on_line ? run.kept_ns : 0);
  }
  return !run.slow && run.hold_us == 0;
}

// Where the driver tells that all has left, it is known how much later that is than it should be.
void SerialPulseMaster::measure_pauses() {
  count_gone(now_us_);
  if (!burst_us_ || !drained(now_us_)) return;
  burst_us_.reset();
  if (status_->empty) add_pause(now_us_ - us_of(line_free_ns_) - kDrainAskUs);
}

void SerialPulseMaster::add_pause(std::int64_t us) {
  constexpr std::int64_t kWorthTellingUs = 1'000;
  if (us <= 0) return;
  pauses_.pauses_us += us;
  pauses_.longest_us = std::max(pauses_.longest_us, us);
  if (pauses_.longest_us < kWorthTellingUs || pauses_.bytes_us == 0) return;
  const double share =
      static_cast<double>(pauses_.pauses_us) / static_cast<double>(pauses_.bytes_us);
  char text[96];
  std::snprintf(text, sizeof text, "pauses amid bytes: %.2f %% of their time, the longest %.1f ms",
                100 * share, 1e-3 * static_cast<double>(pauses_.longest_us));
  pauses_note_ = text;
  tell_note();
}

}  // namespace bushd::serial_pulse
