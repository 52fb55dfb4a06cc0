// The commutator board that one can build: its image for the ATmega328P runs in simavr, with
// decoder, latches, multiplexers and switches at its pins (docs/firmware.md), and motors behind
// them. Or the one with a voltage-to-frequency converter, which has a latch and a DAC before it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "sim/avr/avr_node.h"
#include "sim/board_line.h"
#include "sim/frequency_converter.h"

namespace bushd::sim {

class AvrBoard final : public BoardEnd {
 public:
  // `start_hz`: of its switches, 0..127. `edges` may be null and outlives it. Throws
  // std::runtime_error if the image cannot be read, and, when time goes on, if it crashes or
  // switches windings that turn no motor. It boots at time 0, with latches that are cleared.
  AvrBoard(const std::string& image, std::uint32_t baud, std::uint32_t start_hz,
           EdgeSink* edges = nullptr, std::size_t mcu = 0)
      : AvrBoard(image, baud, start_hz, std::nullopt, edges, mcu) {}
  // With a converter; the latch before its DAC is cleared.
  AvrBoard(const std::string& image, std::uint32_t baud, const FrequencyConverter& converter,
           EdgeSink* edges = nullptr, std::size_t mcu = 0)
      : AvrBoard(image, baud, 0, converter, edges, mcu) {}

  // From its boot until it hears, with the time of the chip's start-up left out.
  static constexpr TimeNs kBootNs = 1'000'000;

  void send(TimeNs now_ns, std::span<const std::uint8_t> bytes) override;
  // The low bit time of a break, which ends a byte time after now at the earliest.
  void send_break(TimeNs now_ns);
  std::vector<std::uint8_t> advance(TimeNs now_ns) override;
  // It is not known what the program waits for: soon.
  TimeNs next_event_ns() const override { return now_ns_ + kLookNs; }
  TimeNs advanced_to_ns() const override { return now_ns_; }
  // What changes there reaches its pins when time goes on.
  BoardMotors& motors() override { return motors_; }
  const BoardMotors& motors() const override { return motors_; }

  AvrNode& node() { return node_; }
  // What the latch of a motor holds; 0: cleared. Each time that it takes something is counted.
  std::uint8_t latch(unsigned motor) const { return latches_.at(motor); }
  std::uint64_t latched() const { return latched_; }

  // Precondition: the board has one. A character that is set applies from now on.
  const FrequencyConverter& converter() const { return converter_.value(); }
  void set_converter(const FrequencyConverter::Character& character);

 private:
  static constexpr TimeNs kLookNs = 200'000;
  static constexpr int kBreak = -1;
  struct Byte {
    TimeNs at_ns;
    int value;
  };
  struct Pin {
    AvrBoard* board;
    std::uint8_t* port;
    std::uint8_t bit;
  };
  AvrBoard(const std::string& image, std::uint32_t baud, std::uint32_t start_hz,
           const std::optional<FrequencyConverter>& converter, EdgeSink* edges, std::size_t mcu);
  void enqueue(TimeNs now_ns, int value);
  static void on_pin(avr_irq_t* irq, std::uint32_t value, void* param);
  void take_windings();
  void take_code();
  void await_pulse();
  static std::uint64_t on_time(avr_t* avr, std::uint64_t cycle, void* param);
  std::uint64_t pulse(std::uint64_t cycle);
  void present();
  unsigned number() const;

  const TimeNs byte_ns_;
  BoardMotors motors_;
  const std::uint32_t switches_;
  std::optional<FrequencyConverter> converter_;
  bool pulse_is_high_ = false;
  std::array<Pin, 24> pins_{};
  std::uint8_t port_b_;
  std::uint8_t port_c_ = 0;
  std::uint8_t port_d_;
  std::array<std::uint8_t, BoardMotors::kMotors> latches_{};
  std::uint64_t latched_ = 0;
  TimeNs now_ns_ = 0;
  std::deque<Byte> to_board_;
  std::deque<Byte> from_board_;
  std::exception_ptr fault_;  // simavr lets no exceptions through
  AvrNode node_;
};

}  // namespace bushd::sim
