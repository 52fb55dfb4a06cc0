#include "sim/commutator_board.h"

#include <utility>

namespace bushd::sim {
namespace {

constexpr std::array<std::uint8_t, 4> kTwoPhase = {0b0011, 0b0110, 0b1100, 0b1001};
constexpr TimeNs kPulseNs = 10'000;  // of STEP in the trace

unsigned place_of(std::uint8_t windings) {
  unsigned place = 0;
  while (kTwoPhase.at(place) != windings) ++place;
  return place;
}

}  // namespace

CommutatorBoard::CommutatorBoard(std::uint32_t start_hz, EdgeSink* edges, std::size_t mcu)
    : start_hz_(start_hz), edges_(edges), mcu_(mcu) {
  windings_.fill(kTwoPhase[0]);
}

void CommutatorBoard::receive(TimeNs now_ns, std::uint8_t byte) {
  advance(now_ns);
  if (cut) return;
  if (byte == 0) {
    selected_ = false;
    return;
  }
  if (!selected_) {
    if (byte < 128) return;
    selected_ = true;
    number_ = byte % 8;
    left_ = byte / 8 % 2 == 1;
    tell(now_ns, Signal::kDir, !left_);
    return;
  }
  if (step_ns_) return;  // it has one timer, which counts
  step_ns_ = now_ns + TimeNs{byte} * 1'000'000'000 / (250 * TimeNs{start_hz_});
}

void CommutatorBoard::advance(TimeNs now_ns) {
  if (!step_ns_ || *step_ns_ > now_ns) return;
  const TimeNs due_ns = *std::exchange(step_ns_, std::nullopt);
  const bool can = supply && motors_.at(number_).connected;
  if (can) make_step(due_ns);
  if (!cut && !loses_answers) answers_.push_back(status(can));
}

void CommutatorBoard::make_step(TimeNs now_ns) {
  phase_.at(number_) = (phase_.at(number_) + (left_ ? 3 : 1)) % 4;
  // The rotor goes to where the windings pull it.
  const unsigned before =
      place_of(std::exchange(windings_.at(number_), kTwoPhase.at(phase_.at(number_))));
  const unsigned turned = (place_of(windings_.at(number_)) + 4 - before) % 4;
  position_.at(number_) += turned == 1 ? 1 : -1;
  ++travel_.at(number_);
  if (keeps_steps) steps_.push_back({now_ns, number_, left_});
  tell(now_ns, Signal::kStep, true);
  tell(now_ns + kPulseNs, Signal::kStep, false);
}

std::uint8_t CommutatorBoard::status(bool step_done) const {
  const Motor& motor = motors_.at(number_);
  unsigned bits = step_done ? 16 : 0;
  if (position_.at(number_) >= motor.right_limit_at) bits += 1;
  if (position_.at(number_) <= motor.left_limit_at) bits += 2;
  if (!supply) bits += 4;
  if (!motor.connected) bits += 8;
  return static_cast<std::uint8_t>(bits);
}

std::vector<std::uint8_t> CommutatorBoard::take_answers() {
  return std::exchange(answers_, {});
}

void CommutatorBoard::tell(TimeNs now_ns, Signal signal, bool level) {
  if (edges_ == nullptr) return;
  last_edge_ns_ = now_ns;
  edges_->edge({.time_ns = now_ns,
                .mcu = mcu_,
                .signal = signal,
                .index = static_cast<std::uint8_t>(number_),
                .level = level});
}

}  // namespace bushd::sim
