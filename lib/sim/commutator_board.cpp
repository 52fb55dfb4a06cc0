#include "sim/commutator_board.h"

#include <algorithm>
#include <utility>

namespace bushd::sim {
namespace {

constexpr std::array<std::uint8_t, 4> kTwoPhase = {0b0011, 0b0110, 0b1100, 0b1001};

}  // namespace

void CommutatorBoard::receive(TimeNs now_ns, std::uint8_t byte) {
  advance(now_ns);
  if (cut) return;
  if (byte == 0) {
    selected_ = false;
    step_ns_.reset();
    if (converter_) converter_->set_code(now_ns, 0);
    return;
  }
  if (!selected_) {
    if (byte / 16 != 8) return;
    selected_ = true;
    number_ = byte % 8;
    left_ = byte / 8 % 2 == 1;
    return;
  }
  if (step_ns_) return;  // it has one timer, which counts
  count(now_ns, byte);
}

void CommutatorBoard::count(TimeNs now_ns, std::uint8_t code) {
  if (converter_) {
    converter_->set_code(now_ns, code);
    step_ns_ = now_ns + kConverterWatchNs;
  } else {
    step_ns_ = now_ns + TimeNs{code} * 1'000'000'000 / (250 * TimeNs{start_hz_});
  }
}

TimeNs CommutatorBoard::next_event_ns() const {
  if (!step_ns_) return kNever;
  return converter_ ? std::min(*step_ns_, converter_->next_pulse_ns()) : *step_ns_;
}

// What it waited for is over: with a step, unless it was a pulse that did not come.
bool CommutatorBoard::over(TimeNs now_ns) {
  step_ns_.reset();
  if (!converter_) return true;
  const std::uint64_t before = converter_->pulses();
  converter_->set_code(now_ns, 0);
  return converter_->pulses() != before;
}

void CommutatorBoard::advance(TimeNs now_ns) {
  const TimeNs due_ns = next_event_ns();
  if (due_ns <= now_ns) {
    const bool has_pulse = over(due_ns);
    const bool can = has_pulse && supply && motor(number_).connected;
    if (can) make_step(due_ns);
    const unsigned no_pulse = has_pulse ? 0 : 32;
    if (!cut && !loses_answers) {
      answers_.push_back(static_cast<std::uint8_t>(status(can) | no_pulse));
    }
  }
  // Pulses for which nothing waits.
  if (converter_) converter_->advance(now_ns);
}

void CommutatorBoard::make_step(TimeNs now_ns) {
  phase_.at(number_) = (phase_.at(number_) + (left_ ? 3 : 1)) % 4;
  switch_windings(now_ns, number_, kTwoPhase.at(phase_.at(number_)));
}

std::uint8_t CommutatorBoard::status(bool step_done) const {
  unsigned bits = step_done ? 16 : 0;
  if (at_right_limit(number_)) bits += 1;
  if (at_left_limit(number_)) bits += 2;
  if (!supply) bits += 4;
  if (!motor(number_).connected) bits += 8;
  return static_cast<std::uint8_t>(bits);
}

std::vector<std::uint8_t> CommutatorBoard::take_answers() {
  return std::exchange(answers_, {});
}

}  // namespace bushd::sim
