// A commutator board at the end of a serial line whose bytes take their time: what Bus is for MCUs.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "sim/commutator_board.h"

namespace bushd::sim {

// Whatever the board is made of.
class BoardEnd {
 public:
  BoardEnd() = default;
  BoardEnd(const BoardEnd&) = delete;
  BoardEnd& operator=(const BoardEnd&) = delete;
  virtual ~BoardEnd() = default;

  // Times never fall, here and below.
  virtual void send(TimeNs now_ns, std::span<const std::uint8_t> bytes) = 0;
  // What has arrived from the board by then.
  virtual std::vector<std::uint8_t> advance(TimeNs now_ns) = 0;
  virtual TimeNs next_event_ns() const = 0;
  virtual TimeNs advanced_to_ns() const = 0;
  virtual BoardMotors& motors() = 0;
  virtual const BoardMotors& motors() const = 0;
};

class BoardLine final : public BoardEnd {
 public:
  // `edges` may be null and outlives it. 8N1: a byte is ten bits.
  BoardLine(std::uint32_t baud, std::uint32_t start_hz, EdgeSink* edges = nullptr,
            std::size_t mcu = 0)
      : board(start_hz, edges, mcu), byte_ns_(10'000'000'000 / baud) {}
  BoardLine(std::uint32_t baud, const FrequencyConverter& converter, EdgeSink* edges = nullptr,
            std::size_t mcu = 0)
      : board(converter, edges, mcu), byte_ns_(10'000'000'000 / baud) {}

  CommutatorBoard board;

  void send(TimeNs now_ns, std::span<const std::uint8_t> bytes) override;
  std::vector<std::uint8_t> advance(TimeNs now_ns) override;
  TimeNs next_event_ns() const override;
  TimeNs advanced_to_ns() const override { return now_ns_; }
  BoardMotors& motors() override { return board; }
  const BoardMotors& motors() const override { return board; }

 private:
  struct Byte {
    TimeNs at_ns;
    std::uint8_t value;
  };
  void run_board(TimeNs now_ns);

  const TimeNs byte_ns_;
  TimeNs now_ns_ = 0;
  std::deque<Byte> to_board_;
  std::deque<Byte> from_board_;
};

}  // namespace bushd::sim
