// A commutator board of BUSHD-2 as one would build it, for simulations: bytes come in at times, and
// after each delay the windings of the selected motor are switched on. It shares no code with
// lib/heritage/commutator, which drives it.
//
// Each motor has four windings, two of them on at a time: 0011, 0110, 1100, 1001 going right. What
// a motor does is seen from its windings alone (position()).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/edge.h"

namespace bushd::sim {

class CommutatorBoard {
 public:
  static constexpr unsigned kMotors = 8;
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  // `edges` may be null and outlives the board; steps are told as edges of STEP and DIR of `mcu`.
  CommutatorBoard(std::uint32_t start_hz, EdgeSink* edges = nullptr, std::size_t mcu = 0);

  // What is around the board.
  struct Motor {
    // The switches are active from these positions on.
    std::int64_t right_limit_at = std::numeric_limits<std::int64_t>::max();
    std::int64_t left_limit_at = std::numeric_limits<std::int64_t>::min();
    bool connected = true;
  };
  Motor& motor(unsigned number) { return motors_.at(number); }
  bool supply = true;
  bool cut = false;            // the line: nothing passes in either direction
  bool loses_answers = false;  // what it sends
  bool keeps_steps = true;     // for steps()

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

  // Steps to the right since the beginning, counted from what the windings did.
  std::int64_t position(unsigned number) const { return position_.at(number); }
  std::uint64_t travel(unsigned number) const { return travel_.at(number); }
  TimeNs last_edge_ns() const { return last_edge_ns_; }
  // All of them.
  struct Step {
    TimeNs time_ns;
    unsigned motor;
    bool left;
  };
  const std::vector<Step>& steps() const { return steps_; }

 private:
  std::uint8_t status(bool step_done) const;
  void make_step(TimeNs now_ns);
  void tell(TimeNs now_ns, Signal signal, bool level);

  const std::uint32_t start_hz_;
  EdgeSink* const edges_;
  const std::size_t mcu_;
  std::array<Motor, kMotors> motors_{};
  std::array<unsigned, kMotors> phase_{};       // the board's own pointer, 0..3
  std::array<std::uint8_t, kMotors> windings_;  // as they are
  std::array<std::int64_t, kMotors> position_{};
  std::array<std::uint64_t, kMotors> travel_{};
  TimeNs last_edge_ns_ = 0;
  bool selected_ = false;
  unsigned number_ = 0;
  bool left_ = false;
  std::optional<TimeNs> step_ns_;
  std::vector<std::uint8_t> answers_;
  std::vector<Step> steps_;
};

}  // namespace bushd::sim
