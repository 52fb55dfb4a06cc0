// Messages of motion: time, ticks, table runs, triggers, homing (engine/message_motion.h).
#include "engine/cursor.h"

// Delays of 48 bits, of which the low 16 stand where shorter ones have theirs, or 0 does. An MCU
// without runs that are so slow knows none.
#if BUSHD_SLOW_RUNS
#define LONG_DELAY 6
static inline uint32_t high_of(bushd_delay delay) {
  return (uint32_t)(delay >> 16);
}
static inline bushd_delay with_high(uint16_t low, uint32_t high) {
  return (bushd_delay)high << 16 | low;
}
#else
static inline uint32_t high_of(bushd_delay delay) {
  (void)delay;
  return 0;
}
#endif

size_t bushd_encode_sync(const bushd_sync* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->master);
  put32(&w, message->sync_id);
  put8(&w, message->follows ? 1 : 0);
  put32(&w, message->follow_up_id);
  put32(&w, message->sync_tick);
  put32(&w, message->sync_ns);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_sync(const uint8_t* payload, size_t size, bushd_sync* message) {
  reader r = read_from(payload, size);
  message->master = get16(&r);
  message->sync_id = get32(&r);
  const uint8_t follows = get8(&r);
  message->follows = follows == 1;
  message->follow_up_id = get32(&r);
  message->sync_tick = get32(&r);
  message->sync_ns = get32(&r);
  return finish(&r, follows <= 1 && message->sync_ns < BUSHD_MAX_TICK_NS);
}

size_t bushd_encode_emergency(const bushd_emergency* message, uint8_t* payload) {
  payload[0] = (uint8_t)message->mode;
  return 1;
}

bushd_status bushd_decode_emergency(const uint8_t* payload, size_t size, bushd_emergency* message) {
  reader r = read_from(payload, size);
  const uint8_t mode = get8(&r);
  const bool known = mode <= BUSHD_STOP_DISABLE;
  message->mode = known ? (bushd_stop_mode)mode : BUSHD_STOP_RAMP;
  return finish(&r, known);
}

static uint8_t bits_set(uint16_t mask) {
  uint8_t bits = 0;
  for (; mask != 0; mask = (uint16_t)(mask & (mask - 1u))) ++bits;
  return bits;
}

uint8_t bushd_ticks_capacity(uint8_t motors, bool fine) {
  const size_t arrays = BUSHD_FRAME_MAX_PAYLOAD - BUSHD_TICKS_HEADER - 2u * motors;
  return (uint8_t)(arrays / (fine ? 2u * motors : motors));
}

size_t bushd_encode_ticks_head(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint8_t count,
                               uint16_t mask, const uint16_t* delays, uint8_t* payload) {
  writer w = {payload};
  put8(&w, epoch);
  put8(&w, flags);
  put32(&w, first_tick);
  put8(&w, count);
  put16(&w, mask);
  const uint8_t motors = bits_set(mask);
  for (uint8_t i = 0; i < motors; ++i) put16(&w, delays[i]);
  return (size_t)(w.at - payload);
}

// A frame cannot replace and start at once.
static bool known_flags(uint8_t flags, uint8_t known) {
  const uint8_t either = BUSHD_TICKS_REPLACE | BUSHD_TICKS_START;
  return (flags & ~known) == 0 && (flags & either) != either;
}

// -32768 has no positive counterpart, and with 128 slots two of its steps would share one.
static bool in_fine_range(const bushd_ticks* message) {
  const uint16_t values = (uint16_t)(message->count * message->motors);
  for (uint16_t i = 0; i < values; ++i) {
    if (bushd_get_i16(message->displacements + 2u * i) == INT16_MIN) return false;
  }
  return true;
}

bushd_status bushd_decode_ticks(const uint8_t* payload, size_t size, bushd_ticks* message) {
  reader r = read_from(payload, size);
  message->epoch = get8(&r);
  message->flags = get8(&r);
  message->first_tick = get32(&r);
  message->count = get8(&r);
  message->mask = get16(&r);
  message->motors = bits_set(message->mask);
  message->delays = take(&r, 2u * message->motors);
  const size_t width = message->flags & BUSHD_TICKS_FINE ? 2 : 1;
  message->displacements = take(&r, width * message->motors * message->count);
  const uint8_t known = BUSHD_TICKS_FINE | BUSHD_TICKS_REPLACE | BUSHD_TICKS_START;
  const bushd_status status =
      finish(&r, known_flags(message->flags, known) && message->count >= 1 && message->mask != 0);
  if (status != BUSHD_OK || width == 1) return status;
  return in_fine_range(message) ? BUSHD_OK : BUSHD_E_FORMAT;
}

// First byte of an entry of TABLE_TICKS and TABLE_RUN: the motor, its direction, and what follows.
#define HEAD_MOTOR 0x0Fu
#define HEAD_POSITIVE 0x80u
#define HEAD_PARTS 0x40u                    // TABLE_TICKS: the parts follow; else it cruises
#define HEAD_SINCE_NS 0x20u                 // TABLE_TICKS
#define HEAD_LEAD 0x10u                     // TABLE_TICKS
#define HEAD_BANK_SHIFT 4u                  // TABLE_RUN: three bits
#define STEPS_LIMITED UINT32_C(0x80000000)  // TABLE_RUN, with the steps: a shortest delay follows

static void put_entry(writer* w, const bushd_table_ticks_entry* entry, uint8_t flags) {
  const bushd_run_state* const state = &entry->state;
  uint8_t head = entry->motor;
  if (state->direction > 0) head |= HEAD_POSITIVE;
  if (!state->cruises) head |= HEAD_PARTS;
  if (state->since_ns != 0) head |= HEAD_SINCE_NS;
  if (state->lead_delay != 0) head |= HEAD_LEAD;
  put8(w, head);
  put16(w, state->since);
  if ((flags & BUSHD_TICKS_CRUISE) != 0) put16(w, state->cruise);
  if (state->since_ns != 0) put32(w, state->since_ns);
  if (state->lead_delay != 0) put16(w, state->lead_delay);
  if (state->cruises) return;
  put16(w, state->accel_at);
  put16(w, state->accel_end);
  put32(w, state->cruise_left);
  put16(w, state->decel_left);
}

// Returns whether each field that the head announces is needed: so a state has one spelling.
static bool get_entry(reader* r, bushd_table_ticks_entry* entry, uint8_t flags) {
  bushd_run_state* const state = &entry->state;
  const uint8_t head = get8(r);
  entry->motor = head & HEAD_MOTOR;
  state->direction = head & HEAD_POSITIVE ? 1 : -1;
  state->cruises = (head & HEAD_PARTS) == 0;
  state->since = get16(r);
  state->cruise = flags & BUSHD_TICKS_CRUISE ? get16(r) : 0;
  state->since_ns = head & HEAD_SINCE_NS ? get32(r) : 0;
  state->lead_delay = head & HEAD_LEAD ? get16(r) : 0;
  state->accel_at = state->cruises ? 0 : get16(r);
  state->accel_end = state->cruises ? 0 : get16(r);
  state->cruise_left = state->cruises ? 0 : get32(r);
  state->decel_left = state->cruises ? 0 : get16(r);
  return (state->since_ns != 0 || (head & HEAD_SINCE_NS) == 0) &&
         (state->lead_delay != 0 || (head & HEAD_LEAD) == 0);
}

size_t bushd_encode_table_ticks(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint16_t count,
                                const bushd_table_ticks_entry* entries, uint8_t motors,
                                uint8_t* payload) {
  writer w = {payload};
  for (uint8_t i = 0; i < motors; ++i) {
    if (entries[i].state.cruise != 0) flags |= BUSHD_TICKS_CRUISE;
  }
  put8(&w, epoch);
  put8(&w, flags);
  put32(&w, first_tick);
  put16(&w, count);
  for (uint8_t i = 0; i < motors; ++i) put_entry(&w, &entries[i], flags);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_ticks(const uint8_t* payload, size_t size,
                                      bushd_table_ticks* message) {
  reader r = read_from(payload, size);
  message->epoch = get8(&r);
  message->flags = get8(&r);
  message->first_tick = get32(&r);
  message->count = get16(&r);
  if (r.short_of_bytes) return BUSHD_E_LENGTH;
  message->entries = r.at;
  message->entries_size = (uint16_t)(r.end - r.at);
  message->mask = 0;
  bool in_range = true;
  bool tells_cruise = false;
  while (r.at != r.end && !r.short_of_bytes) {
    bushd_table_ticks_entry entry;
    if (!get_entry(&r, &entry, message->flags)) in_range = false;
    if (entry.state.cruise != 0) tells_cruise = true;
    const uint16_t bit = (uint16_t)(1u << entry.motor);
    if (message->mask >= bit) in_range = false;
    message->mask |= bit;
  }
  if (tells_cruise != ((message->flags & BUSHD_TICKS_CRUISE) != 0)) in_range = false;
  const uint8_t known = BUSHD_TICKS_REPLACE | BUSHD_TICKS_START | BUSHD_TICKS_CRUISE;
  return finish(&r, known_flags(message->flags, known) && message->count >= 1 &&
                        message->mask != 0 && in_range);
}

bool bushd_next_table_ticks_entry(const bushd_table_ticks* message, uint16_t* at,
                                  bushd_table_ticks_entry* entry) {
  if (*at >= message->entries_size) return false;
  reader r = read_from(message->entries + *at, (size_t)(message->entries_size - *at));
  get_entry(&r, entry, message->flags);
  *at = (uint16_t)(r.at - message->entries);
  return true;
}

static void put_run_entries(writer* w, const bushd_table_run_entry* entries, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) {
    uint8_t head = (uint8_t)(entries[i].motor | entries[i].bank << HEAD_BANK_SHIFT);
    if (entries[i].direction > 0) head |= HEAD_POSITIVE;
    put8(w, head);
    const bushd_delay shortest_delay = entries[i].shortest_delay;
    put32(w, entries[i].steps | (shortest_delay != 0 ? STEPS_LIMITED : 0));
    if (shortest_delay == 0) continue;
    if (high_of(shortest_delay) != 0) put16(w, 0);
    put16(w, (uint16_t)shortest_delay);
    if (high_of(shortest_delay) != 0) put32(w, high_of(shortest_delay));
  }
}

// `in_range`: a shortest delay that is announced is one.
static bushd_delay get_shortest_delay(reader* r, bool* in_range) {
  const uint16_t shortest_delay = get16(r);
  if (shortest_delay != 0) return shortest_delay;
#if BUSHD_SLOW_RUNS
  if (r->end - r->at >= LONG_DELAY) {
    const uint16_t low = get16(r);
    const uint32_t high = get32(r);
    if (high != 0) return with_high(low, high);
  }
#endif
  *in_range = false;
  return 0;
}

static bushd_table_run_entry get_run_entry(reader* r, bool* in_range) {
  const uint8_t head = get8(r);
  const uint32_t steps = get32(r);
  const bushd_delay shortest_delay =
      (steps & STEPS_LIMITED) != 0 ? get_shortest_delay(r, in_range) : (bushd_delay)0;
  const bushd_table_run_entry entry = {
      (uint8_t)(head & HEAD_MOTOR), (uint8_t)(head >> HEAD_BANK_SHIFT & 7u),
      head & HEAD_POSITIVE ? 1 : -1, steps & ~STEPS_LIMITED, shortest_delay};
  return entry;
}

// All that is left. `in_range`: motors rise, and each is to make steps.
static const uint8_t* get_run_entries(reader* r, uint8_t* count, bool* in_range) {
  const uint8_t* const entries = r->at;
  uint16_t mask = 0;
  for (*count = 0; r->at != r->end; ++*count) {
    const bushd_table_run_entry entry = get_run_entry(r, in_range);
    if (r->short_of_bytes) break;
    const uint16_t bit = (uint16_t)(1u << entry.motor);
    if (mask >= bit || entry.steps == 0) *in_range = false;
    mask |= bit;
  }
  return entries;
}

bushd_table_run_entry bushd_next_table_run_entry(const uint8_t** at) {
  reader r = read_from(*at, BUSHD_TABLE_RUN_MAX_ENTRY);
  bool in_range = true;
  const bushd_table_run_entry entry = get_run_entry(&r, &in_range);
  *at = r.at;
  return entry;
}

size_t bushd_encode_table_run(uint8_t epoch, uint32_t first_tick,
                              const bushd_table_run_entry* entries, uint8_t count,
                              uint8_t* payload) {
  writer w = {payload};
  put8(&w, epoch);
  put32(&w, first_tick);
  put_run_entries(&w, entries, count);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_run(const uint8_t* payload, size_t size, bushd_table_run* message) {
  reader r = read_from(payload, size);
  message->epoch = get8(&r);
  message->first_tick = get32(&r);
  if (r.short_of_bytes) return BUSHD_E_LENGTH;
  bool in_range = true;
  message->entries = get_run_entries(&r, &message->count, &in_range);
  return finish(&r, message->count >= 1 && in_range);
}

size_t bushd_encode_trigger(uint8_t number, bushd_edge edge, uint32_t delay_us,
                            const bushd_table_run_entry* entries, uint8_t count, uint8_t* payload) {
  writer w = {payload};
  put8(&w, number);
  put8(&w, (uint8_t)edge);
  put32(&w, delay_us);
  put_run_entries(&w, entries, count);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_trigger(const uint8_t* payload, size_t size, bushd_trigger* message) {
  reader r = read_from(payload, size);
  message->number = get8(&r);
  const uint8_t edge = get8(&r);
  message->edge = edge == BUSHD_EDGE_RISING    ? BUSHD_EDGE_RISING
                  : edge == BUSHD_EDGE_FALLING ? BUSHD_EDGE_FALLING
                                               : BUSHD_EDGE_NONE;
  message->delay_us = get32(&r);
  if (r.short_of_bytes) return BUSHD_E_LENGTH;
  bool in_range = true;
  message->entries = get_run_entries(&r, &message->count, &in_range);
  if (edge == BUSHD_EDGE_NONE) {
    in_range = message->number == 0 && message->delay_us == 0 && message->count == 0;
  } else if (message->number == 0 || message->delay_us < BUSHD_TRIGGER_MIN_DELAY_US ||
             message->delay_us > BUSHD_TRIGGER_MAX_DELAY_US || message->count == 0) {
    in_range = false;
  }
  return finish(&r, edge <= BUSHD_EDGE_FALLING && in_range);
}

size_t bushd_encode_position_compare(const bushd_position_compare* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, message->arrivals);
  put32(&w, (uint32_t)message->position_steps);
  put32(&w, message->delay_us);
  put32(&w, message->width_us);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_position_compare(const uint8_t* payload, size_t size,
                                           bushd_position_compare* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->arrivals = get8(&r);
  message->position_steps = (int32_t)get32(&r);
  message->delay_us = get32(&r);
  message->width_us = get32(&r);
  const uint8_t all = BUSHD_ARRIVES_POSITIVE | BUSHD_ARRIVES_NEGATIVE;
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU && message->arrivals <= all &&
                        message->delay_us <= BUSHD_POSITION_COMPARE_MAX_DELAY_US &&
                        message->width_us >= 1 &&
                        message->width_us <= BUSHD_POSITION_COMPARE_MAX_WIDTH_US);
}

size_t bushd_encode_home(const bushd_home* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, (uint8_t)message->direction);
  put32(&w, message->most_steps);
  put16(&w, (uint16_t)message->shortest_delay);
  put32(&w, message->slow_steps);
  put16(&w, (uint16_t)message->slow_delay);
  put32(&w, (uint32_t)message->position_steps);
  if ((high_of(message->shortest_delay) | high_of(message->slow_delay)) != 0) {
    put32(&w, high_of(message->shortest_delay));
    put32(&w, high_of(message->slow_delay));
  }
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_home(const uint8_t* payload, size_t size, bushd_home* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->direction = (int8_t)get8(&r);
  message->most_steps = get32(&r);
  message->shortest_delay = get16(&r);
  message->slow_steps = get32(&r);
  message->slow_delay = get16(&r);
  message->position_steps = (int32_t)get32(&r);
  bool in_range = true;
#if BUSHD_SLOW_RUNS
  if (r.at != r.end) {
    const uint32_t shortest_delay = get32(&r);
    const uint32_t slow_delay = get32(&r);
    message->shortest_delay = with_high((uint16_t)message->shortest_delay, shortest_delay);
    message->slow_delay = with_high((uint16_t)message->slow_delay, slow_delay);
    in_range = (shortest_delay | slow_delay) != 0;
  }
#endif
  return finish(&r, in_range && message->motor < BUSHD_MOTORS_PER_MCU &&
                        (message->direction == 1 || message->direction == -1) &&
                        message->most_steps <= INT32_MAX && message->slow_steps >= 1 &&
                        message->slow_steps <= INT32_MAX && message->slow_delay >= 1);
}

size_t bushd_encode_local(const bushd_local* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->motors);
  put16(&w, message->keypad);
  put16(&w, message->keypad_ticks);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_local(const uint8_t* payload, size_t size, bushd_local* message) {
  reader r = read_from(payload, size);
  message->motors = get16(&r);
  message->keypad = get16(&r);
  message->keypad_ticks = get16(&r);
  return finish(&r, true);
}
