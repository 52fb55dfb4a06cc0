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
//
// By the elementary law (engine/elementary.h) an envelope has A(floor(r k) - e) / a. Where a
// motor's steps are at least a steps of the line apart, 1 / r is less than a + 1 on a line of two
// motors, and less than a 2^(n - 1) of n: each motor before it, and itself, rounds down once, which
// is less than half. And e is n - 2 at most. So with f(a) = a + 1, or a 2^(n - 1), the table of any
// such line is also not below
//
//     max over a >= 1 of A(floor(k / f(a)) - e) / a ,    and the same of D, an index lower.
#pragma once

#include <span>
#include <string>

#include "tables/table.h"

namespace bushd::tables {

// Precondition: each passed bushd_table_check; there is one at least. Its time unit is the shortest
// of theirs, or a longer one if the slowest delay would not fit 16 bits. Errors: more codes than a
// table may have, a side of 2^31 time units.
// `elementary`: so many motors are on a line by that law at most; below 2: none is.
Result<TablePtr> any_line_table(std::span<const bushd_table* const> tables, std::string name,
                                unsigned elementary = 0);

}  // namespace bushd::tables
