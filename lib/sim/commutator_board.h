// A commutator board of BUSHD-2 as one would build it, for simulations: bytes come in at times, and
// after each delay the windings of the selected motor are switched on. It shares no code with
// lib/heritage/commutator, which drives it, nor with firmware/commutator, which is compared with
// it. With a converter its steps are pulses of that one, and codes are K of the DAC before it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sim/board_motors.h"
#include "sim/frequency_converter.h"

namespace bushd::sim {

class CommutatorBoard : public BoardMotors {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  CommutatorBoard(std::uint32_t start_hz, EdgeSink* edges = nullptr, std::size_t mcu = 0)
      : BoardMotors(edges, mcu), start_hz_(start_hz) {}
  explicit CommutatorBoard(const FrequencyConverter& converter, EdgeSink* edges = nullptr,
                           std::size_t mcu = 0)
      : BoardMotors(edges, mcu), start_hz_(0), converter_(converter) {}

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
  TimeNs next_event_ns() const;
  std::vector<std::uint8_t> take_answers();

  // Precondition: the board has one.
  const FrequencyConverter& converter() const { return converter_.value(); }
  void set_converter(TimeNs now_ns, const FrequencyConverter::Character& character) {
    advance(now_ns);
    converter_.value().set_character(now_ns, character);
  }

 private:
  static constexpr TimeNs kConverterWatchNs = 1'000'000'000;

  std::uint8_t status(bool step_done) const;
  void count(TimeNs now_ns, std::uint8_t code);
  bool over(TimeNs now_ns);
  void make_step(TimeNs now_ns);

  const std::uint32_t start_hz_;
  std::array<unsigned, kMotors> phase_{};  // the board's own pointer, 0..3
  bool selected_ = false;
  unsigned number_ = 0;
  bool left_ = false;
  std::optional<TimeNs> step_ns_;  // with a converter: when it is taken for dead
  std::optional<FrequencyConverter> converter_;
  std::vector<std::uint8_t> answers_;
};

}  // namespace bushd::sim
