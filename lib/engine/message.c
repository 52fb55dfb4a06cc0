#include "engine/message.h"

// A cursor over a payload. Reading beyond the end yields zeros and is remembered, so that a decoder
// reads its fields in a row and asks once.
typedef struct reader {
  const uint8_t* at;
  const uint8_t* end;
  bool short_of_bytes;
} reader;

static const uint8_t* take(reader* r, size_t size) {
  static const uint8_t kZeros[4] = {0, 0, 0, 0};
  if ((size_t)(r->end - r->at) < size) {
    r->short_of_bytes = true;
    return kZeros;
  }
  const uint8_t* const at = r->at;
  r->at += size;
  return at;
}
static uint8_t get8(reader* r) {
  return *take(r, 1);
}
static uint16_t get16(reader* r) {
  return bushd_get_u16(take(r, 2));
}
static uint32_t get32(reader* r) {
  return bushd_get_u32(take(r, 4));
}
static reader read_from(const uint8_t* payload, size_t size) {
  const reader r = {payload, payload + size, false};
  return r;
}
// The whole payload and nothing else must have been read; then the ranges count.
static bushd_status finish(const reader* r, bool in_range) {
  if (r->short_of_bytes || r->at != r->end) return BUSHD_E_LENGTH;
  return in_range ? BUSHD_OK : BUSHD_E_FORMAT;
}

typedef struct writer {
  uint8_t* at;
} writer;

static void put8(writer* w, uint8_t value) {
  *w->at++ = value;
}
static void put16(writer* w, uint16_t value) {
  bushd_put_u16(w->at, value);
  w->at += 2;
}
static void put32(writer* w, uint32_t value) {
  bushd_put_u32(w->at, value);
  w->at += 4;
}

size_t bushd_encode_identity(const bushd_identity* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->protocol_version);
  put8(&w, message->motors);
  put16(&w, message->firmware_version);
  put16(&w, message->boot_number);
  put16(&w, message->slots);
  put16(&w, message->queue_ticks);
  put16(&w, message->table_codes);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_identity(const uint8_t* payload, size_t size, bushd_identity* message) {
  reader r = read_from(payload, size);
  message->protocol_version = get8(&r);
  message->motors = get8(&r);
  message->firmware_version = get16(&r);
  message->boot_number = get16(&r);
  message->slots = get16(&r);
  message->queue_ticks = get16(&r);
  message->table_codes = get16(&r);
  return finish(&r, message->motors >= 1 && message->motors <= BUSHD_MOTORS_PER_MCU);
}

size_t bushd_encode_configure(const bushd_configure* message, uint8_t* payload) {
  writer w = {payload};
  put32(&w, message->tick_ns);
  put8(&w, (uint8_t)message->format);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_configure(const uint8_t* payload, size_t size, bushd_configure* message) {
  reader r = read_from(payload, size);
  message->tick_ns = get32(&r);
  const uint8_t format = get8(&r);
  message->format = format == BUSHD_FORMAT_FINE ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  return finish(&r, message->tick_ns >= BUSHD_MIN_TICK_NS &&
                        message->tick_ns <= BUSHD_MAX_TICK_NS && format <= BUSHD_FORMAT_FINE);
}

size_t bushd_encode_table_begin(const bushd_table_begin* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->slot);
  put16(&w, message->accel_count);
  put16(&w, message->decel_count);
  put16(&w, message->cruise);
  put32(&w, message->time_unit_ns);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_begin(const uint8_t* payload, size_t size,
                                      bushd_table_begin* message) {
  reader r = read_from(payload, size);
  message->slot = get8(&r);
  message->accel_count = get16(&r);
  message->decel_count = get16(&r);
  message->cruise = get16(&r);
  message->time_unit_ns = get32(&r);
  return finish(&r, message->slot < BUSHD_TABLE_SLOTS && message->accel_count >= 1 &&
                        message->cruise >= 1 && message->time_unit_ns >= 1);
}

size_t bushd_encode_table_data(uint8_t slot, uint16_t offset, uint8_t count, const uint16_t* codes,
                               uint8_t* payload) {
  writer w = {payload};
  put8(&w, slot);
  put16(&w, offset);
  put8(&w, count);
  for (uint8_t i = 0; i < count; ++i) put16(&w, codes[i]);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_data(const uint8_t* payload, size_t size,
                                     bushd_table_data* message) {
  reader r = read_from(payload, size);
  message->slot = get8(&r);
  message->offset = get16(&r);
  message->count = get8(&r);
  message->codes = take(&r, 2u * message->count);
  return finish(&r, message->slot < BUSHD_TABLE_SLOTS && message->count >= 1 &&
                        message->count <= BUSHD_TABLE_DATA_MAX_CODES);
}

size_t bushd_encode_table_end(const bushd_table_end* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->slot);
  put16(&w, message->crc);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_table_end(const uint8_t* payload, size_t size, bushd_table_end* message) {
  reader r = read_from(payload, size);
  message->slot = get8(&r);
  message->crc = get16(&r);
  return finish(&r, message->slot < BUSHD_TABLE_SLOTS);
}

size_t bushd_encode_assign(const bushd_assign* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put8(&w, message->slot);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_assign(const uint8_t* payload, size_t size, bushd_assign* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->slot = get8(&r);
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU && message->slot < BUSHD_TABLE_SLOTS);
}

size_t bushd_encode_control(const bushd_control* message, uint8_t* payload) {
  payload[0] = message->actions;
  return 1;
}

bushd_status bushd_decode_control(const uint8_t* payload, size_t size, bushd_control* message) {
  reader r = read_from(payload, size);
  message->actions = get8(&r);
  const uint8_t both = BUSHD_CONTROL_ENABLE | BUSHD_CONTROL_DISABLE;
  return finish(&r, message->actions <= (both | BUSHD_CONTROL_CLEAR_FAULTS) &&
                        (message->actions & both) != both);
}

size_t bushd_encode_set_position(const bushd_set_position* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->motor);
  put32(&w, (uint32_t)message->position_steps);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_set_position(const uint8_t* payload, size_t size,
                                       bushd_set_position* message) {
  reader r = read_from(payload, size);
  message->motor = get8(&r);
  message->position_steps = (int32_t)get32(&r);
  return finish(&r, message->motor < BUSHD_MOTORS_PER_MCU);
}

size_t bushd_encode_sync(const bushd_sync* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->follows ? 1 : 0);
  put8(&w, message->mark_tag);
  put32(&w, message->mark_tick);
  put32(&w, message->mark_ns);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_sync(const uint8_t* payload, size_t size, bushd_sync* message) {
  reader r = read_from(payload, size);
  const uint8_t follows = get8(&r);
  message->follows = follows == 1;
  message->mark_tag = get8(&r);
  message->mark_tick = get32(&r);
  message->mark_ns = get32(&r);
  return finish(&r, follows <= 1 && message->mark_ns < BUSHD_MAX_TICK_NS);
}

static uint8_t bits_set(uint16_t mask) {
  uint8_t bits = 0;
  for (; mask != 0; mask = (uint16_t)(mask & (mask - 1u))) ++bits;
  return bits;
}

uint8_t bushd_ticks_capacity(uint8_t motors, bool fine, bool delays) {
  const size_t arrays = BUSHD_FRAME_MAX_PAYLOAD - BUSHD_TICKS_HEADER - (delays ? 2u * motors : 0u);
  return (uint8_t)(arrays / (fine ? 2u * motors : motors));
}

size_t bushd_encode_ticks_head(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint8_t count,
                               uint16_t mask, const uint16_t* delays, uint8_t* payload) {
  writer w = {payload};
  put8(&w, epoch);
  if (delays != NULL) flags |= BUSHD_TICKS_DELAYS;
  put8(&w, flags);
  put32(&w, first_tick);
  put8(&w, count);
  put16(&w, mask);
  if (delays != NULL) {
    const uint8_t motors = bits_set(mask);
    for (uint8_t i = 0; i < motors; ++i) put16(&w, delays[i]);
  }
  return (size_t)(w.at - payload);
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
  message->delays = NULL;
  if (message->flags & BUSHD_TICKS_DELAYS) message->delays = take(&r, 2u * message->motors);
  const size_t width = message->flags & BUSHD_TICKS_FINE ? 2 : 1;
  message->displacements = take(&r, width * message->motors * message->count);
  const uint8_t known =
      BUSHD_TICKS_FINE | BUSHD_TICKS_DELAYS | BUSHD_TICKS_REPLACE | BUSHD_TICKS_START;
  const uint8_t either = BUSHD_TICKS_REPLACE | BUSHD_TICKS_START;
  const bushd_status status =
      finish(&r, message->flags <= known && (message->flags & either) != either &&
                     message->count >= 1 && message->mask != 0);
  if (status != BUSHD_OK || width == 1) return status;
  return in_fine_range(message) ? BUSHD_OK : BUSHD_E_FORMAT;
}

size_t bushd_encode_report(const bushd_report* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->state);
  put8(&w, message->faults);
  put8(&w, message->flags);
  put8(&w, message->epoch);
  put16(&w, message->boot_number);
  put32(&w, message->tick);
  put32(&w, message->tick_ns);
  put8(&w, message->mark_tag);
  put32(&w, message->mark_tick);
  put32(&w, message->mark_ns);
  put16(&w, message->moving);
  put16(&w, message->inputs);
  put16(&w, message->bad_frames);
  put16(&w, message->rejected_frames);
  put8(&w, message->last_rejection);
  put8(&w, message->motor_count);
  for (uint8_t i = 0; i < message->motor_count; ++i) {
    put32(&w, (uint32_t)message->motor[i].position_steps);
    put16(&w, message->motor[i].known_until);
  }
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_report(const uint8_t* payload, size_t size, bushd_report* message) {
  reader r = read_from(payload, size);
  message->state = get8(&r);
  message->faults = get8(&r);
  message->flags = get8(&r);
  message->epoch = get8(&r);
  message->boot_number = get16(&r);
  message->tick = get32(&r);
  message->tick_ns = get32(&r);
  message->mark_tag = get8(&r);
  message->mark_tick = get32(&r);
  message->mark_ns = get32(&r);
  message->moving = get16(&r);
  message->inputs = get16(&r);
  message->bad_frames = get16(&r);
  message->rejected_frames = get16(&r);
  message->last_rejection = get8(&r);
  message->motor_count = get8(&r);
  if (message->motor_count > BUSHD_MOTORS_PER_MCU) return BUSHD_E_FORMAT;
  for (uint8_t i = 0; i < message->motor_count; ++i) {
    message->motor[i].position_steps = (int32_t)get32(&r);
    message->motor[i].known_until = get16(&r);
  }
  return finish(&r, message->state <= BUSHD_STATE_FAULT);
}

size_t bushd_encode_acknowledgement(const bushd_acknowledgement* message, uint8_t* payload) {
  payload[0] = message->status;
  return 1;
}

bushd_status bushd_decode_acknowledgement(const uint8_t* payload, size_t size,
                                          bushd_acknowledgement* message) {
  reader r = read_from(payload, size);
  message->status = get8(&r);
  return finish(&r, true);
}
