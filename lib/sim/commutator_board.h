// A commutator board of BUSHD-2 as one would build it, for simulations: bytes come in at times, and
// after each delay the windings of the selected motor are switched on. It shares no code with
// lib/heritage/commutator, which drives it, nor with firmware/commutator, which is compared with
// it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/board_motors.h"

namespace bushd::sim {

class CommutatorBoard : public BoardMotors {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  CommutatorBoard(std::uint32_t start_hz, EdgeSink* edges = nullptr, std::size_t mcu = 0)
      : BoardMotors(edges, mcu), start_hz_(start_hz) {}

  bool cut = false;            // the line: nothing passes in either direction
  bool loses_answers = false;  // what it sends

  // A byte's stop bit ended. Times never fall.
  void receive(TimeNs now_ns, std::uint8_t byte);
  void advance(TimeNs now_ns);
  // It knows of no motor and no code any more. Its latches keep the windings as they are.
  void reset() {
    selected_ = false;
    step_ns_.reset();
    answers_.clear();
  }
  TimeNs next_event_ns() const { return step_ns_.value_or(kNever); }
  std::vector<std::uint8_t> take_answers();

 private:
  std::uint8_t status(bool step_done) const;
  void make_step(TimeNs now_ns);

  const std::uint32_t start_hz_;
  std::array<unsigned, kMotors> phase_{};  // the board's own pointer, 0..3
  bool selected_ = false;
  unsigned number_ = 0;
  bool left_ = false;
  std::optional<TimeNs> step_ns_;
  std::vector<std::uint8_t> answers_;
};

}  // namespace bushd::sim
