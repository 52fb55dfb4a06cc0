// A commutator board at the end of a serial line whose bytes take their time: what Bus is for MCUs.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "sim/commutator_board.h"

namespace bushd::sim {

class BoardLine {
 public:
  // `edges` may be null and outlives it.
  BoardLine(std::uint32_t baud, std::uint32_t start_hz, EdgeSink* edges = nullptr,
            std::size_t mcu = 0)
      : board(start_hz, edges, mcu), byte_ns_(10'000'000'000 / baud) {}

  CommutatorBoard board;

  // Times never fall, here and below. 8N1: a byte is ten bits.
  void send(TimeNs now_ns, std::span<const std::uint8_t> bytes);
  // What has arrived from the board by then.
  std::vector<std::uint8_t> advance(TimeNs now_ns);
  TimeNs next_event_ns() const;
  TimeNs advanced_to_ns() const { return now_ns_; }

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
