// A half-duplex RS-485 pair: who talks when, and what happens when two talk at once.
//
// A byte takes 10 bit times (start, 8 data, stop). Bytes of one talker never overlap each other;
// where those of two talkers do, all of them arrive corrupted: a pattern is put over them, always
// the same, so that a simulation can be repeated. Byte boundaries are kept exact over any length of
// time, also where 10 bit times are no whole number of ns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "sim/edge.h"

namespace bushd::sim {

inline constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();
inline constexpr std::int64_t kBitsPerByte = 10;

struct Collision {
  TimeNs time_ns;         // when the second one began
  std::size_t talker[2];  // in the order in which their bytes began
};

struct WireByte {
  TimeNs start_ns;
  TimeNs end_ns;
  std::uint8_t value;  // as heard
  std::size_t talker;
  bool corrupted;
  std::optional<Collision> collision;  // set on the first byte that shows a new one
};

class Wire {
 public:
  // Precondition: baud > 0.
  explicit Wire(std::uint32_t baud) : baud_(baud) {}

  // Talkers are numbered from 0.
  std::size_t add_talker();

  // Puts bytes behind those that this talker has still to send, at `at_ns` at the earliest.
  // Returns the end of the last one. Precondition: at_ns is not before the last byte taken.
  TimeNs send(std::size_t talker, std::span<const std::uint8_t> bytes, TimeNs at_ns);

  // The talker falls silent at now_ns: the byte on the bus is broken off (and so corrupted), those
  // behind it are dropped.
  void silence(std::size_t talker, TimeNs now_ns);

  // End of the byte that ends next, kNever if there is none. O(1).
  TimeNs next_end_ns() const { return next_end_ns_; }

  // Takes that byte off the bus. Of bytes that end together, that of the lower talker comes first.
  // Precondition: there is one. O(talkers).
  WireByte take();

  // Does the talker drive the line at any time within (from_ns, until_ns)? Right for the present
  // byte only: the past is forgotten. O(1).
  bool drives(std::size_t talker, TimeNs from_ns, TimeNs until_ns) const;

  // When the last byte now waiting ends; not after now if the line is free. O(talkers).
  TimeNs busy_until_ns() const;

 private:
  struct Byte {
    TimeNs start_ns;
    TimeNs end_ns;
    std::uint8_t value;
    bool broken_off;
  };
  struct Talker {
    std::deque<Byte> waiting;
    Byte last{};  // taken last; start_ns == end_ns: none yet
    // Bytes without a gap between them share an origin, so that rounding does not add up.
    TimeNs origin_ns = 0;
    std::int64_t bytes_since_origin = 0;
    TimeNs free_ns = 0;
  };

  // The range of `talker` that overlaps with [start_ns, end_ns); nothing if there is none.
  static const Byte* overlap(const Talker& talker, TimeNs start_ns, TimeNs end_ns);
  void find_next();

  std::uint32_t baud_;
  std::vector<Talker> talkers_;
  std::size_t next_talker_ = 0;
  TimeNs next_end_ns_ = kNever;
  TimeNs collision_until_ns_ = -1;
};

}  // namespace bushd::sim
