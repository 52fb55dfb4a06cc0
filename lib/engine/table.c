#include "engine/table.h"

#include <stddef.h>

#include "engine/frame.h"

static bushd_status check_ramp(const bushd_ramp* ramp, bool sorted, uint32_t* bad_index) {
  uint32_t sum = 0;
  *bad_index = 0;
  if (ramp->code == NULL || ramp->count == 0) return BUSHD_E_TABLE_EMPTY;
  for (uint32_t i = 0; i < ramp->count; ++i) {
    *bad_index = i;
    if (ramp->code[i] == 0) return BUSHD_E_TABLE_ZERO;
    if (sorted && i > 0 && ramp->code[i] > ramp->code[i - 1]) return BUSHD_E_TABLE_UNSORTED;
    // A run adds a tick (at most 127 delays of 16 bits) to such a sum: keep clear of 2^32.
    if (sum > UINT32_MAX / 2 - ramp->code[i]) return BUSHD_E_TABLE_TOO_LONG;
    sum += ramp->code[i];
  }
  return BUSHD_OK;
}

bushd_status bushd_table_check(const bushd_table* table, uint32_t* bad_index, bool* bad_decel) {
  uint32_t index = 0;
  bool decel = false;
  bushd_status status = check_ramp(&table->accel, true, &index);
  if (status == BUSHD_OK) {
    decel = true;
    status = check_ramp(&table->decel, true, &index);
  }
  if (status == BUSHD_OK && (table->cruise == 0 || table->time_unit_ns == 0)) {
    status = BUSHD_E_TABLE_ZERO;
  }
  if (bad_index != NULL) *bad_index = index;
  if (bad_decel != NULL) *bad_decel = decel;
  return status;
}

bushd_status bushd_table_check_written(const bushd_table* table) {
  uint32_t index;
  bushd_status status = check_ramp(&table->accel, false, &index);
  if (status == BUSHD_OK) status = check_ramp(&table->decel, false, &index);
  if (status != BUSHD_OK) return status;
  return table->cruise == 0 || table->time_unit_ns == 0 ? BUSHD_E_TABLE_ZERO : BUSHD_OK;
}

bool bushd_table_is_written(const bushd_table* table) {
  return bushd_table_check(table, NULL, NULL) == BUSHD_E_TABLE_UNSORTED;
}

static uint16_t shortest(const bushd_ramp* ramp, uint16_t delay) {
  for (uint16_t i = 0; i < ramp->count; ++i) {
    if (ramp->code[i] < delay) delay = ramp->code[i];
  }
  return delay;
}

uint16_t bushd_written_fastest(const bushd_table* table) {
  return shortest(&table->decel, shortest(&table->accel, table->cruise));
}

uint16_t bushd_table_accel(const bushd_table* table, uint32_t i) {
  return i < table->accel.count ? table->accel.code[i] : table->cruise;
}

uint16_t bushd_table_decel(const bushd_table* table, uint32_t i) {
  return i < table->decel.count ? table->decel.code[i] : table->cruise;
}

uint16_t bushd_table_delay(const bushd_table* table, uint32_t j, uint32_t n) {
  uint16_t delay = table->cruise;
  const uint16_t accel = bushd_table_accel(table, j - 1);
  const uint16_t decel = bushd_table_decel(table, n - j);
  if (accel > delay) delay = accel;
  if (decel > delay) delay = decel;
  return delay;
}

uint32_t bushd_table_steps_to_stop(const bushd_table* table, bushd_delay delay) {
  // D(k) never rises with k, and is the cruise delay from `count` on: binary search for the first
  // D(k) <= delay. A delay below cruise cannot be running; the whole side is then the honest
  // answer.
  uint32_t low = 0;
  uint32_t high = table->decel.count;
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (table->decel.code[middle] <= delay) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

uint16_t bushd_table_fastest(const bushd_table* table) {
  // Every delay is a maximum with the cruise delay, and a long move reaches it.
  return table->cruise;
}

// Steps at the shortest delay x: a stretch of length T holds at most floor(T / x) + 1 of them.
static uint32_t steps_at(uint16_t delay, const bushd_table* table, uint32_t tick_ns) {
  const uint64_t shortest_ns = (uint64_t)delay * table->time_unit_ns;
  const uint64_t steps = tick_ns / shortest_ns + 1;
  return steps > UINT32_MAX ? UINT32_MAX : (uint32_t)steps;
}

uint32_t bushd_table_max_steps_per_tick(const bushd_table* table, uint32_t tick_ns) {
  return steps_at(bushd_table_fastest(table), table, tick_ns);
}

uint32_t bushd_written_max_steps_per_tick(const bushd_table* table, uint32_t tick_ns) {
  return steps_at(bushd_written_fastest(table), table, tick_ns);
}

static uint32_t crc32_u16(uint32_t crc, uint16_t value) {
  const uint8_t bytes[2] = {(uint8_t)value, (uint8_t)(value >> 8)};
  return bushd_crc32(crc, bytes, sizeof bytes);
}

static uint32_t crc32_codes(uint32_t crc, const bushd_ramp* ramp) {
  for (uint32_t i = 0; i < ramp->count; ++i) crc = crc32_u16(crc, ramp->code[i]);
  return crc;
}

uint32_t bushd_table_crc32(const bushd_table* table) {
  const bool symmetric = table->decel.code == table->accel.code;
  uint32_t crc = BUSHD_CRC32_START;
  crc = crc32_u16(crc, table->accel.count);
  crc = crc32_u16(crc, symmetric ? (uint16_t)0 : table->decel.count);
  crc = crc32_u16(crc, table->cruise);
  crc = crc32_u16(crc, (uint16_t)table->time_unit_ns);
  crc = crc32_u16(crc, (uint16_t)(table->time_unit_ns >> 16));
  crc = crc32_codes(crc, &table->accel);
  if (!symmetric) crc = crc32_codes(crc, &table->decel);
  return ~crc;
}

#if BUSHD_RAMP_INDEX

uint32_t bushd_ramp_sum_entries(const bushd_ramp* ramp) {
  return ramp->count + 1u;
}

// Buckets no wider than the shortest delay hold at most one step each, so that a look-up needs one
// comparison. A table with a huge spread of delays would need too many: then they are wider, up to
// about eight entries a code, and the look-up takes a few comparisons more.
static uint8_t bucket_shift(const bushd_ramp* ramp, uint32_t total) {
  uint8_t shift = 0;
  while ((UINT32_C(2) << shift) <= ramp->code[ramp->count - 1]) ++shift;
  while ((total >> shift) / 8 > ramp->count + 8u) ++shift;
  return shift;
}

static uint32_t total_units(const bushd_ramp* ramp) {
  uint32_t total = 0;
  for (uint32_t i = 0; i < ramp->count; ++i) total += ramp->code[i];
  return total;
}

uint32_t bushd_ramp_bucket_entries(const bushd_ramp* ramp) {
  const uint32_t total = total_units(ramp);
  return (total >> bucket_shift(ramp, total)) + 1;
}

void bushd_ramp_index(bushd_ramp* ramp, uint32_t* sum, uint32_t* bucket) {
  uint32_t total = 0;
  for (uint32_t i = 0; i < ramp->count; ++i) {
    sum[i] = total;
    total += ramp->code[i];
  }
  sum[ramp->count] = total;
  const uint8_t shift = bucket_shift(ramp, total);
  uint32_t i = 0;
  for (uint32_t b = 0; b <= total >> shift; ++b) {
    while (i < ramp->count && sum[i + 1] <= b << shift) ++i;
    bucket[b] = i;
  }
  ramp->sum = sum;
  ramp->bucket = bucket;
  ramp->bucket_shift = shift;
}

#endif
