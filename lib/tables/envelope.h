// The table of several motors on one line (engine/line.h): made of theirs, and a table like any
// other. With r(i) = |N(i)| / L, k from 0, all rounded up:
//
//     A(k) = max r(i) A_i( floor(r(i) k) )
//     D(k) = max r(i) D_i(k) where r(i) = 1, else r(i) D_i( max(0, floor(r(i) k) - 1) )
//     c    = max r(i) c_i
//
// and the shortest delay of the run = max r(i) (that of motor i). A run by it leaves no two steps
// of a motor closer together than the motor's own table does, whenever the run is made to ramp
// down, unless that shortens a run that ramps down already. So a slow start or a low top speed of
// one motor costs only where it acts. Of motors with one table and equal ways it is that table.
//
// By the elementary law (engine/elementary.h) L is the sum of all N. Steps of a motor lie
// a whole number of those of the run apart, at least a(i), so 1 / a(i) stands in place of r(i)
// before a delay; and some steps of the run may have e(i) steps of the motor less than floor(r(i)
// k), so much lower is the index of A_i and D_i.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/table.h"

namespace bushd::tables {

struct LinePart {
  const bushd_table* table;        // passed bushd_table_check
  std::uint32_t increment;         // |N|
  bushd_delay shortest_delay = 0;  // none of its steps has a shorter delay; 0: none
  // By the elementary law: bushd_elementary_apart, which is 0 by the other one, and
  // bushd_elementary_late.
  std::uint32_t apart = 0;
  std::uint8_t late = 0;
};

// Not copied: view() points into it.
class Envelope {
 public:
  // Precondition: longest >= 1 and >= every increment, < 2^31; some increment is not 0.
  // A side that needs more than kMostCodes is cut off there: the line is no faster than that.
  Envelope(std::span<const LinePart> parts, std::uint32_t longest);
  Envelope(const Envelope&) = delete;
  Envelope& operator=(const Envelope&) = delete;

  static constexpr std::size_t kMostCodes = 32767;  // of a side

  // Passed bushd_table_check, and both sides are indexed. Its time unit is the shortest of the
  // motors', or a longer one if the slowest delay, or shortest delay, would not fit 16 bits.
  const bushd_table& view() const { return view_; }
  bushd_delay shortest_delay() const { return shortest_delay_; }
  // With other shortest delays of its motors, which may have more bits.
  bushd_delay shortest_delay_of(std::span<const LinePart> parts, std::uint32_t longest) const;

 private:
  struct Side {
    std::vector<std::uint16_t> code;
    std::vector<std::uint32_t> sum;
    std::vector<std::uint32_t> bucket;
    bushd_ramp index();
  };

  Side accel_;
  Side decel_;
  bushd_delay shortest_delay_ = 0;
  bushd_table view_{};
};

// Which of them makes the line take as long as it does: the first one whose part alone would take
// longest. Precondition: as of Envelope.
std::size_t limiting_part(std::span<const LinePart> parts, std::uint32_t longest);

}  // namespace bushd::tables
