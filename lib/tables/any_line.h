// The table of any line of some motors, whatever their shares of it: for lines whose points are not
// known when the table is uploaded, such as those of a program that an MCU carries out. With the
// tables A, D, c of a motor, k from 0, all rounded up, and the greatest of all motors:
//
//     A'(k) = max( A(k), c, max over m < k of (m + 1) A(m) / k )
//     D'(k) = max( D(k), c, max over m < k of (m + 1) D(max(0, m - 1)) / k )
//
// An envelope (tables/envelope.h) has r A(floor(r k)) with r up to 1. Where floor(r k) = m, r is
// less than (m + 1) / k, or 1: so no envelope of these motors is above this table, and what an
// envelope guarantees holds for it too.
#pragma once

#include <span>
#include <string>

#include "tables/table.h"

namespace bushd::tables {

// Precondition: each passed bushd_table_check; there is one at least. Its time unit is the shortest
// of theirs, or a longer one if the slowest delay would not fit 16 bits. Errors: more codes than a
// table may have, a side of 2^31 time units.
Result<TablePtr> any_line_table(std::span<const bushd_table* const> tables, std::string name);

}  // namespace bushd::tables
