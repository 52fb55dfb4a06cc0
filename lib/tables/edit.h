// Changes of a table's content, pure functions. None makes a step faster by rounding: delays are
// rounded up. The result has passed check(); what would not is refused with its reason.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables {

enum class SideKey { kAccel, kDecel };  // decel where there is none: a mirror image is written out

// Indices count from 0 in the order of the file.
Result<TableContent> set_codes(TableContent content, SideKey side, std::size_t index,
                               std::span<const std::uint16_t> codes);
Result<TableContent> insert_codes(TableContent content, SideKey side, std::size_t index,
                                  std::span<const std::uint16_t> codes);
Result<TableContent> delete_codes(TableContent content, SideKey side, std::size_t index,
                                  std::size_t count);

// All speeds times `factor`, above 0. The codes are in the same time unit if that holds all of them
// (1..65535) and the sums of the sides, and rounding costs no speed more than 1 %; else in the
// one of the finest units that hold them whose rounding costs least. Refused beyond units of 1
// ns..1 s.
Result<TableContent> scale_speed(TableContent content, double factor);
// The same speeds with `factor` times the acceleration: the square of the speed over the path,
// which becomes 1 / factor as long. The greatest acceleration becomes at most `factor` times what
// it was, but for the rounding of codes; steps and time become about 1 / factor of what they were.
// A cruise delay that is faster than a side counts as its last step.
Result<TableContent> scale_acceleration(TableContent content, double factor);
// The same delays in another time unit.
Result<TableContent> resample_unit(TableContent content, std::uint32_t time_unit_ns);
// Each side with `codes` codes and the same speeds: the acceleration changes accordingly.
Result<TableContent> resample_codes(TableContent content, std::size_t codes);
// The greatest share by which a speed of `after` falls below that of `before` times `factor`, code
// by code. Precondition: as many codes.
double greatest_shortfall(const TableContent& before, const TableContent& after, double factor);
// Accelerates as it braked, and brakes as it accelerated.
Result<TableContent> reverse(TableContent content);

}  // namespace bushd::tables
