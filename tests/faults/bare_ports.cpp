#include "bare_ports.h"

#include <algorithm>
#include <utility>

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr std::size_t kFifoBytes = 16;
constexpr TimeNs kAdapterHoldsNs = 15'000'000;
// With what lay before it there a byte is late by at most 17 ms, of the 20 that are allowed; so not
// two pauses within them.
constexpr TimeNs kLongestPauseNs = 2'000'000;
constexpr TimeNs kPauseEveryNs = 20'000'000;
constexpr TimeNs kKeyEveryNs = 100'000'000;

}  // namespace

PulsePort::PulsePort(std::uint64_t seed, std::uint32_t stream, bushd::sim::EdgeSink& edges,
                     std::size_t index)
    : drive(&edges, index),
      random_(seed, stream),
      hardware_(static_cast<Hardware>(random_.below(3))),
      any_rate_(!random_.one_in(3)),
      base_(any_rate_ && random_.one_in(2) ? 115'200 : 0) {
  drive.keeps_steps = false;
}

// A rate below `ask` is made of a divisor; the drive's is a whole number, so is what is told.
std::uint32_t PulsePort::made_of(std::uint32_t ask) const {
  if (base_ == 0 || ask > base_) return ask;
  const std::uint32_t divisor = (base_ + ask / 2) / ask;
  return base_ / divisor;
}

bushd::link::PulseStatus PulsePort::carry_out(TimeNs now_ns, const bushd::link::PulseOrder& order) {
  advance_to(now_ns);
  const bool turns = order.positive && *order.positive != drive.positive();
  if (!idle() && (order.baud || turns)) ++changed_amid_bytes_;
  if (order.positive) drive.set_direction(now_ns, *order.positive);
  if (order.baud) drive.set_baud(now_ns, made_of(*order.baud));
  driver_.insert(driver_.end(), order.bytes.begin(), order.bytes.end());
  advance_to(now_ns);
  bushd::link::PulseStatus status;
  status.any_rate = any_rate_;
  status.base = base_;
  status.baud = drive.baud();
  status.queued = driver_.size();
  if (hardware_ != Hardware::kMuteAdapter) status.empty = idle();
  status.lines = drive.lines();
  status.positive = drive.positive();
  return status;
}

std::size_t PulsePort::room() const {
  if (hardware_ == Hardware::kUart) return kFifoBytes;
  const TimeNs byte_ns = 10'000'000'000 / drive.baud() + 1;
  return static_cast<std::size_t>(kAdapterHoldsNs / byte_ns);
}

// The next byte from the driver: where one takes longer than the adapter may be late, none waits
// there for the one on the line.
PulsePort::TimeNs PulsePort::passes_from_ns() const {
  if (room() > 0) return stalled_until_ns_;
  return std::max({stalled_until_ns_, drive.line_free_ns(), pause_until_ns_});
}

void PulsePort::advance_to(TimeNs now_ns) {
  TimeNs t_ns = at_ns_;
  while (true) {
    while (!driver_.empty() && unseen_.size() < std::max<std::size_t>(room(), 1) &&
           t_ns >= passes_from_ns()) {
      unseen_.push_back(driver_.front());
      driver_.pop_front();
    }
    if (unseen_.empty()) {
      if (driver_.empty() || passes_from_ns() > now_ns) break;
      t_ns = passes_from_ns();
      continue;
    }
    const TimeNs start_ns = std::max({t_ns, drive.line_free_ns(), pause_until_ns_});
    if (start_ns > now_ns) break;
    t_ns = start_ns;
    drive.send(start_ns, std::span(&unseen_.front(), 1));
    unseen_.pop_front();
    if (hardware_ == Hardware::kUart || start_ns < next_pause_ns_ || !random_.one_in(8)) continue;
    pause_until_ns_ = drive.line_free_ns() + random_.between(100'000, kLongestPauseNs);
    next_pause_ns_ = pause_until_ns_ + kPauseEveryNs;
  }
  at_ns_ = std::max(at_ns_, now_ns);
  drive.advance_to(now_ns);
}

void PulsePort::break_off(TimeNs now_ns) {
  advance_to(now_ns);
  driver_.clear();
  unseen_.clear();
  drive.break_off(now_ns);
}

// --- Boards

BoardPort::BoardPort(const bushd::config::Bus& bus, std::uint64_t seed, std::uint32_t stream,
                     bushd::sim::EdgeSink& edges, std::size_t index)
    : line_(bus.baud, bus.start_hz, &edges, index), random_(seed, stream) {
  line_.board.keeps_steps = false;
}

void BoardPort::arrive(TimeNs at_ns, std::uint8_t byte) {
  if (!on_way_.empty()) at_ns = std::max(at_ns, on_way_.back().at_ns);
  on_way_.push_back({at_ns, byte});
}

void BoardPort::advance_to(TimeNs now_ns) {
  line_.board.cut = now_ns < cut_until_ns_;
  line_.board.supply = now_ns >= no_supply_until_ns_;
  constexpr std::uint8_t kStepDone = 1 << 4;
  for (std::uint8_t answer : line_.advance(now_ns)) {
    const bool done = (answer & kStepDone) != 0;
    const auto fault = done ? std::exchange(spoil_, std::nullopt) : std::nullopt;
    if (fault == AnswerFault::kLost) continue;
    // Not into one that is good and tells of another step.
    if (fault == AnswerFault::kGarbled) {
      answer = static_cast<std::uint8_t>(answer ^ (1u << random_.below(8)));
    }
    const TimeNs late_ns =
        fault == AnswerFault::kLate ? random_.magnitude(1'000'000, 900'000'000) : 0;
    arrive(now_ns + late_ns, answer);
    if (fault == AnswerFault::kRepeated) arrive(now_ns + late_ns, answer);
  }
  if (noise_) make_noise(now_ns);
}

std::vector<std::uint8_t> BoardPort::take_received(TimeNs now_ns) {
  std::vector<std::uint8_t> bytes;
  for (; received(now_ns); on_way_.pop_front()) bytes.push_back(on_way_.front().byte);
  return bytes;
}

void BoardPort::send(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  if (!bytes.empty()) sent_ns_ = now_ns;
  line_.send(now_ns, bytes);
}

void BoardPort::make_noise(TimeNs now_ns) {
  constexpr TimeNs kMarginNs = 1'000'000;
  const TimeNs step_ns = line_.board.next_event_ns();
  const bool counts = step_ns != bushd::sim::CommutatorBoard::kNever;
  if (counts && step_ns - now_ns < (step_ns - sent_ns_) / 2 + kMarginNs) return;
  if (!counts && line_.next_event_ns() != bushd::sim::CommutatorBoard::kNever) return;
  if (!on_way_.empty()) return;
  noise_ = false;
  for (std::uint64_t left = random_.below(5) + 1; left > 0; --left) {
    arrive(now_ns, static_cast<std::uint8_t>(random_.below(256)));
  }
}

// --- Keypads

void KeypadBox::press(TimeNs now_ns, bool forward, TimeNs for_ns) {
  let_go(now_ns);
  key_ = forward ? kForward : kReverse;
  next_ns_ = now_ns;
  until_ns_ = now_ns + for_ns;
}

void KeypadBox::let_go(TimeNs now_ns) {
  if (!std::exchange(key_, std::nullopt)) return;
  if (latched_ && now_ns >= pulled_until_ns_) bytes_.push_back(kStop);
}

void KeypadBox::advance_to(TimeNs now_ns) {
  if (!key_) return;
  if (now_ns >= until_ns_) return let_go(now_ns);
  if (now_ns < next_ns_) return;
  if (now_ns >= pulled_until_ns_) bytes_.push_back(*key_);
  next_ns_ = latched_ ? until_ns_ : next_ns_ + kKeyEveryNs;
}

std::vector<std::uint8_t> KeypadBox::take_bytes() {
  return std::exchange(bytes_, {});
}

}  // namespace bushfaults
