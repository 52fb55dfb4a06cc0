#include "sim/board_motors.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace bushd::sim {
namespace {

constexpr std::array<std::uint8_t, 4> kPlaces = {0b0011, 0b0110, 0b1100, 0b1001};
constexpr TimeNs kPulseNs = 10'000;  // of STEP in the trace

}  // namespace

BoardMotors::BoardMotors(EdgeSink* edges, std::size_t mcu) : edges_(edges), mcu_(mcu) {}

bool BoardMotors::at_right_limit(unsigned number) const {
  return position_.at(number) >= motors_.at(number).right_limit_at;
}

bool BoardMotors::at_left_limit(unsigned number) const {
  return position_.at(number) <= motors_.at(number).left_limit_at;
}

void BoardMotors::switch_windings(TimeNs now_ns, unsigned number, std::uint8_t windings) {
  const auto* const found = std::ranges::find(kPlaces, windings);
  const auto place = static_cast<unsigned>(found - kPlaces.begin());
  const unsigned turned = (place + kPlaces.size() - place_.at(number)) % kPlaces.size();
  if (found == kPlaces.end() || turned == 2) {
    throw std::runtime_error("motor " + std::to_string(number) + " of the board: windings " +
                             std::to_string(windings) + " turn it nowhere");
  }
  if (turned == 0) return;
  const bool left = turned == 3;
  place_.at(number) = place;
  position_.at(number) += left ? -1 : 1;
  ++travel_.at(number);
  if (keeps_steps) steps_.push_back({now_ns, number, left});
  tell(now_ns, number, Signal::kDir, !left);
  tell(now_ns, number, Signal::kStep, true);
  tell(now_ns + kPulseNs, number, Signal::kStep, false);
}

void BoardMotors::tell(TimeNs now_ns, unsigned number, Signal signal, bool level) {
  if (edges_ == nullptr) return;
  last_edge_ns_ = now_ns;
  edges_->edge({.time_ns = now_ns,
                .mcu = mcu_,
                .signal = signal,
                .index = static_cast<std::uint8_t>(number),
                .level = level});
}

}  // namespace bushd::sim
