// The serial adapter between host and line, and what the cable does to bytes. No clock: the caller
// says what time it is.
//
// Answers reach the host in packets, as those of an FT232 (FTDI, AN232B-04): one goes out when 62
// bytes are held, and whenever the latency timer has run since the packet before, with or without
// bytes. So a byte is held for anything between nothing and the latency. Requests pass at once.
//
// Bit errors are between line and adapter: each data bit, in either direction, is flipped with the
// same probability, whatever became of the others. What MCUs hear of each other stays right.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/edge.h"
#include "sim/random.h"
#include "sim/wire.h"

namespace bushsim {

struct AdapterOptions {
  bushd::sim::TimeNs latency_ns = 0;  // 0: each byte goes on at once
  double bit_error_rate = 0;          // 0, or 1e-9 to 0.5
  std::uint64_t seed = 0;             // of bit errors
};

class Adapter {
 public:
  static constexpr std::size_t kPacketBytes = 62;

  explicit Adapter(const AdapterOptions& options);

  // Bytes on their way to the line, as they arrive there.
  void pass_to_line(std::span<std::uint8_t> bytes) { flip_bits(to_line_, bytes); }

  // A byte has arrived from the line. Times never fall.
  void take_from_line(std::uint8_t byte, bushd::sim::TimeNs time_ns);

  // What the host has got by now_ns and not been given yet; not before the last time told.
  std::vector<std::uint8_t> take_packets(bushd::sim::TimeNs now_ns);

  // When the bytes that are held go to the host, at the latest. kNever: none are.
  bushd::sim::TimeNs next_packet_ns() const;

  // It loses its power, and what it holds.
  void drop() { held_.clear(); }

  std::uint64_t flipped_bits() const { return flipped_bits_; }

 private:
  struct Direction {
    bushd::sim::Random random;
    std::uint64_t right_bits;  // before the next one that is flipped
  };

  Direction direction(std::uint32_t stream) const;
  std::uint64_t run_of_right_bits(bushd::sim::Random& random) const;
  void flip_bits(Direction& direction, std::span<std::uint8_t> bytes);
  void run_timer(bushd::sim::TimeNs until_ns);
  void send_packet(bushd::sim::TimeNs time_ns);

  AdapterOptions options_;
  Direction to_line_;
  Direction from_line_;
  bushd::sim::TimeNs timer_ns_;  // when it has run next
  std::vector<std::uint8_t> held_;
  std::vector<std::uint8_t> sent_;
  std::uint64_t flipped_bits_ = 0;
};

}  // namespace bushsim
