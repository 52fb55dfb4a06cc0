#include "engine/message_line.h"

#include "engine/cursor.h"

#define HEAD_MOTOR 0x0Fu
#define HEAD_POSITIVE 0x80u
#define BANK_ELEMENTARY 0x80u

static bushd_line_entry get_entry(reader* r, bool* in_range) {
  const uint8_t head = get8(r);
  const bushd_line_entry entry = {(uint8_t)(head & HEAD_MOTOR), head & HEAD_POSITIVE ? 1 : -1,
                                  get32(r)};
  if ((head & (uint8_t)~(HEAD_MOTOR | HEAD_POSITIVE)) != 0) *in_range = false;
  return entry;
}

// All that is left: motors rise, and none makes more steps than the longest.
static void get_entries(reader* r, bushd_line_part* line, bool* in_range) {
  line->entries = r->at;
#if BUSHD_ELEMENTARY
  uint64_t sum = 0;
#endif
  uint16_t mask = 0;
  for (line->count = 0; r->at != r->end; ++line->count) {
    const bushd_line_entry entry = get_entry(r, in_range);
    if (r->short_of_bytes) return;
    const uint16_t bit = (uint16_t)(1u << entry.motor);
    if (mask >= bit || entry.increment == 0 || entry.increment > line->longest) *in_range = false;
    mask |= bit;
#if BUSHD_ELEMENTARY
    sum += entry.increment;
#endif
  }
  if (line->count == 0) *in_range = false;
#if BUSHD_ELEMENTARY
  if (line->elementary && (line->from != 0 || sum != line->longest)) *in_range = false;
#endif
}

bushd_line_entry bushd_next_line_entry(const uint8_t** at) {
  reader r = read_from(*at, BUSHD_LINE_RUN_ENTRY);
  bool in_range = true;
  const bushd_line_entry entry = get_entry(&r, &in_range);
  *at = r.at;
  return entry;
}

static void put_line(writer* w, const bushd_line_part* line, const bushd_line_entry* entries,
                     uint8_t count) {
#if BUSHD_ELEMENTARY
  put8(w, (uint8_t)(line->bank | (line->elementary ? BANK_ELEMENTARY : 0u)));
#else
  put8(w, line->bank);
#endif
  put16(w, line->shortest_delay);
  put32(w, line->longest);
  put32(w, line->from);
  put32(w, line->steps);
  for (uint8_t i = 0; i < count; ++i) {
    put8(w, (uint8_t)(entries[i].motor | (entries[i].direction > 0 ? HEAD_POSITIVE : 0u)));
    put32(w, entries[i].increment);
  }
}

// To the payload's end.
static bushd_status get_line(reader* r, bushd_line_part* line, bool in_range) {
  line->bank = get8(r);
#if BUSHD_ELEMENTARY
  line->elementary = (line->bank & BANK_ELEMENTARY) != 0;
  line->bank = (uint8_t)(line->bank & ~BANK_ELEMENTARY);
#endif
  line->shortest_delay = get16(r);
  line->longest = get32(r);
  line->from = get32(r);
  line->steps = get32(r);
  if (r->short_of_bytes) return BUSHD_E_LENGTH;
  if (line->bank > BUSHD_SCRATCH_BANK || line->longest > INT32_MAX || line->from >= line->longest ||
      line->steps < 1 || line->steps > line->longest - line->from) {
    in_range = false;
  }
  get_entries(r, line, &in_range);
  return finish(r, in_range);
}

size_t bushd_encode_line_run(const bushd_line_run* message, const bushd_line_entry* entries,
                             uint8_t count, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->epoch);
  put32(&w, message->first_tick);
  put_line(&w, &message->line, entries, count);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_line_run(const uint8_t* payload, size_t size, bushd_line_run* message) {
  reader r = read_from(payload, size);
  message->epoch = get8(&r);
  message->first_tick = get32(&r);
  return get_line(&r, &message->line, true);
}

size_t bushd_encode_line_trigger(const bushd_line_trigger* message, const bushd_line_entry* entries,
                                 uint8_t count, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->number);
  put8(&w, (uint8_t)message->edge);
  put32(&w, message->delay_us);
  put_line(&w, &message->line, entries, count);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_line_trigger(const uint8_t* payload, size_t size,
                                       bushd_line_trigger* message) {
  reader r = read_from(payload, size);
  message->number = get8(&r);
  const uint8_t edge = get8(&r);
  message->edge = (bushd_edge)edge;
  message->delay_us = get32(&r);
  const bool in_range = message->number != 0 &&
                        (edge == BUSHD_EDGE_RISING || edge == BUSHD_EDGE_FALLING) &&
                        message->delay_us >= BUSHD_TRIGGER_MIN_DELAY_US &&
                        message->delay_us <= BUSHD_TRIGGER_MAX_DELAY_US;
  return get_line(&r, &message->line, in_range);
}
