// A table's codes in one line, as a move that just comes to cruise meets them: accel, the cruise
// delay, decel. Places count from 0. The decelerating side of a table that has none of its own is
// its mirror image: a change of either changes both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "curve.h"
#include "tables/table.h"

namespace bushtab {

// Precondition of all: check(content) finds nothing, and places are below code_count().

std::size_t code_count(const bushd::tables::TableContent& content);

struct CodePlace {
  CurveStep::Part part = CurveStep::Part::kAccel;
  std::size_t index = 0;  // in its side, in the order of the file
};
CodePlace place_of(const bushd::tables::TableContent& content, std::size_t at);
std::uint16_t code_at(const bushd::tables::TableContent& content, std::size_t at);
// "accel[3]", "cruise"
std::string place_text(const bushd::tables::TableContent& content, std::size_t at);

struct CodeRange {
  std::size_t first = 0;
  std::size_t last = 0;  // included
  bool contains(std::size_t at) const { return first <= at && at <= last; }
};

// What becomes of a code; must not turn the order of two codes round.
using CodeChange = std::function<double(std::uint16_t)>;

// The range's codes changed, rounded up, and kept between the codes before and behind the range, so
// that the result is a table again. `held` counts the codes that would have gone further.
// The cruise delay of a table that tells none goes with the last code of accel.
struct Changed {
  bushd::tables::TableContent content;
  std::size_t held = 0;
};
Changed change_codes(bushd::tables::TableContent content, CodeRange range,
                     const CodeChange& change);

// These may give what is no table: check() tells.
bushd::tables::TableContent with_code(bushd::tables::TableContent content, CodeRange range,
                                      std::uint16_t code);
// The code once more; of cruise nothing changes.
bushd::tables::TableContent with_copy(bushd::tables::TableContent content, std::size_t at);
// A cruise delay in the range is dropped: it is then that of the last code of accel.
bushd::tables::TableContent without_codes(bushd::tables::TableContent content, CodeRange range);

// Where two contents differ, for the log: "accel[3..17], cruise", "accel 238 to 240 codes".
std::string difference_text(const bushd::tables::TableContent& before,
                            const bushd::tables::TableContent& after);

}  // namespace bushtab
