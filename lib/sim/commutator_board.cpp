#include "sim/commutator_board.h"

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
  step_ns_ = now_ns + TimeNs{byte} * 1'000'000'000 / (250 * TimeNs{start_hz_});
}

void CommutatorBoard::advance(TimeNs now_ns) {
  if (!step_ns_ || *step_ns_ > now_ns) return;
  const TimeNs due_ns = *std::exchange(step_ns_, std::nullopt);
  const bool can = supply && motor(number_).connected;
  if (can) make_step(due_ns);
  if (!cut && !loses_answers) answers_.push_back(status(can));
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
