// Acceleration tables and the delay rule.
//
// A table holds delays in whole time units. A delay stands *before* its step. With A(i) the i-th
// delay from rest, D(i) the delay i steps before the end and c the cruise delay,
//
//     delay before step j of N  =  max( A(j-1), D(N-j), c ),   j = 1 .. N        (the BUSHD rule)
//
// where A(i) = c for i >= the length of the accelerating side, and D(i) = c behind its own (JINR
// P10-85-635, figure 4: mode 1 and mode 2 of BUSHD-2 are the short and the long case of this one
// formula).
#ifndef BUSHD_ENGINE_TABLE_H
#define BUSHD_ENGINE_TABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Tables may have an index. A build for a small MCU does without, and with the memory for it.
#ifndef BUSHD_RAMP_INDEX
#define BUSHD_RAMP_INDEX 1
#endif

// Runs may have delays beyond the 16 bits of a code. A build for a small MCU does without, and with
// the memory for it.
#ifndef BUSHD_SLOW_RUNS
#define BUSHD_SLOW_RUNS 1
#endif

// Times of a run, in time units: `bushd_delay` before a step, `bushd_since` after the last one,
// which may be negative, modulo its width.
#if BUSHD_SLOW_RUNS
typedef uint64_t bushd_delay;
typedef uint64_t bushd_since;
typedef int64_t bushd_signed_since;
#else
typedef uint16_t bushd_delay;
typedef uint32_t bushd_since;
typedef int32_t bushd_signed_since;
#endif

// Whether it has the 16 bits of a code.
static inline bool bushd_delay_is_code(bushd_delay delay) {
#if BUSHD_SLOW_RUNS
  return delay <= UINT16_MAX;
#else
  (void)delay;
  return true;
#endif
}

// No step takes longer.
#define BUSHD_LONGEST_DELAY_NS UINT64_C(3600000000000)

// One side of a table, ordered from slow to fast: code[0] is the delay next to rest.
// The index is optional (all set or all NULL): with it a run finds its place in a ramp in constant
// time (bushd_ramp_index makes it); without, it walks the codes. Results agree.
typedef struct bushd_ramp {
  const uint16_t* code;  // `count` delays in time units, 1..65535, never rising but as written
  uint16_t count;        // >= 1
#if BUSHD_RAMP_INDEX
  const uint32_t* sum;     // count + 1 entries: sum[i] = code[0] + ... + code[i-1]
  const uint32_t* bucket;  // entry b: the greatest i with sum[i] <= b << bucket_shift
  uint8_t bucket_shift;
#endif
} bushd_ramp;

// A view of a table; the caller owns all memory and keeps it alive and unchanged while a run uses
// it.
typedef struct bushd_table {
  bushd_ramp accel;       // A(i) = accel.code[i]
  bushd_ramp decel;       // D(i) = decel.code[i]: i steps before the end (a file lists it reversed)
  uint16_t cruise;        // c, time units, >= 1
  uint32_t time_unit_ns;  // >= 1
} bushd_table;

// Checks all that a run relies on: no empty side, no zero, sides never rising, sums below 2^31.
// On error *bad_index (may be NULL) is the index, from slow to fast, of the offending code and
// *bad_decel (may be NULL) tells its side. O(count).
bushd_status bushd_table_check(const bushd_table* table, uint32_t* bad_index, bool* bad_decel);

// Codes as they are written: both sides may rise and fall. Nothing but bushd_run_start_as_written
// may be made of them, and no ramp-down. The same checks but for the order. O(count).
bushd_status bushd_table_check_written(const bushd_table* table);
// Whether a table with these checks is not one that bushd_table_check lets pass. O(count).
bool bushd_table_is_written(const bushd_table* table);
// The shortest of all its codes, and bushd_table_max_steps_per_tick of it. O(count).
uint16_t bushd_written_fastest(const bushd_table* table);
uint32_t bushd_written_max_steps_per_tick(const bushd_table* table, uint32_t tick_ns);

// A(i), D(i) and the delay before step j of N (1 <= j <= N), in time units. O(1).
uint16_t bushd_table_accel(const bushd_table* table, uint32_t i);
uint16_t bushd_table_decel(const bushd_table* table, uint32_t i);
uint16_t bushd_table_delay(const bushd_table* table, uint32_t j, uint32_t n);

// The fewest steps k with D(k) <= delay: after a step made at `delay` a ramp-down takes k more
// steps, with the delays D(k-1) .. D(0). O(log count).
uint32_t bushd_table_steps_to_stop(const bushd_table* table, bushd_delay delay);

// The shortest delay that any move with this table can have, in time units. O(1).
uint16_t bushd_table_fastest(const bushd_table* table);

// Upper bound of the steps within any stretch of `tick_ns`; saturates at UINT32_MAX. O(1).
uint32_t bushd_table_max_steps_per_tick(const bushd_table* table, uint32_t tick_ns);

// CRC-32/ISO-HDLC (polynomial 0x04C11DB7, reflected, start and final inversion; of "123456789":
// 0xCBF43926) of what a table holds, little-endian: the number of accelerating codes, of
// decelerating ones (0 if both sides are the same array), the cruise delay (16 bits each), the time
// unit (32), then the codes of both sides (16), slow to fast. O(count).
uint32_t bushd_table_crc32(const bushd_table* table);

#if BUSHD_RAMP_INDEX
// Memory for the index of a ramp: entries needed for `sum` and `bucket`. O(1) and O(count).
uint32_t bushd_ramp_sum_entries(const bushd_ramp* ramp);
uint32_t bushd_ramp_bucket_entries(const bushd_ramp* ramp);

// Fills the caller's arrays (of at least the sizes above) and attaches them to `ramp`.
// Precondition: the ramp passed bushd_table_check. O(count).
void bushd_ramp_index(bushd_ramp* ramp, uint32_t* sum, uint32_t* bucket);
#endif

#ifdef __cplusplus
}
#endif
#endif
