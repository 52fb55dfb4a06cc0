// POLL and what it is answered by, REPORT (engine/message_report.h).
#include "engine/message_report.h"

#include "engine/cursor.h"

size_t bushd_encode_poll(const bushd_poll_entry* entries, uint8_t count, uint8_t* payload) {
  writer w = {payload};
  put8(&w, count);
  for (uint8_t i = 0; i < count; ++i) {
    put8(&w, entries[i].address);
    put16(&w, entries[i].begin_units);
    put8(&w, entries[i].known);
    put8(&w, entries[i].room);
  }
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_poll(const uint8_t* payload, size_t size, bushd_poll* message) {
  reader r = read_from(payload, size);
  message->count = get8(&r);
  message->entries = take(&r, (size_t)message->count * BUSHD_POLL_ENTRY);
  return finish(&r, message->count >= 1);
}

bool bushd_poll_find(const bushd_poll* poll, uint8_t address, bushd_poll_entry* entry) {
  for (uint8_t i = 0; i < poll->count; ++i) {
    const uint8_t* const at = poll->entries + (size_t)i * BUSHD_POLL_ENTRY;
    if (at[0] != address) continue;
    entry->address = address;
    entry->begin_units = bushd_get_u16(at + 1);
    entry->known = at[3];
    entry->room = at[4];
    return true;
  }
  return false;
}

#define PUT_8(value) put8(&w, value)
#define PUT_16(value) put16(&w, value)
#define PUT_32(value) put32(&w, value)
#define PUT_S32(value) put32(&w, (uint32_t)(value))
#define PUT(type, name) PUT_##type(from->name);
#define PUT_SECTION(name, bit, fields)              \
  if ((from->sections & BUSHD_TELLS_##name) != 0) { \
    fields(PUT)                                     \
  }

size_t bushd_encode_report(const bushd_report* message, uint8_t* payload) {
  writer w = {payload};
  {
    const bushd_report* const from = message;
    BUSHD_REPORT_BASE(PUT)
    BUSHD_REPORT_SECTIONS(PUT_SECTION)
  }
  const bushd_motor_report* from = message->motor;
  for (uint16_t left = message->motors; left != 0; left = (uint16_t)(left >> 1), ++from) {
    if ((left & 1u) == 0) continue;
    BUSHD_REPORT_MOTOR(PUT)
  }
  return (size_t)(w.at - payload);
}

#define ADD_SECTION(name, bit, fields) \
  if ((sections & BUSHD_TELLS_##name) != 0) size += 0u fields(BUSHD_FIELD_BYTES);

size_t bushd_report_size(uint8_t sections, uint16_t motors) {
  size_t size = BUSHD_REPORT_BASE_SIZE;
  BUSHD_REPORT_SECTIONS(ADD_SECTION)
  for (; motors != 0; motors = (uint16_t)(motors >> 1)) {
    if ((motors & 1u) != 0) size += BUSHD_REPORT_MOTOR_SIZE;
  }
  return size;
}

void bushd_report_rest(bushd_report* message) {
  message->running = 0;
  message->autonomous = 0;
  message->low_water_ticks = UINT16_MAX;
  message->out_of_order = 0;
  message->out_of_order_from = 0;
  message->out_of_order_until = 0;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    message->motor[m].known_until = (uint16_t)(message->tick + BUSHD_REST_KNOWN_TICKS);
  }
}

#define GET_8() get8(&r)
#define GET_16() get16(&r)
#define GET_32() get32(&r)
#define GET_S32() (int32_t)get32(&r)
#define GET(type, name) to->name = GET_##type();
#define GET_SECTION(name, bit, fields)            \
  if ((to->sections & BUSHD_TELLS_##name) != 0) { \
    fields(GET)                                   \
  }

static bool in_range(const bushd_report* message) {
  if (message->state > BUSHD_STATE_FAULT || message->trigger_state > BUSHD_TRIGGER_FORBIDDEN ||
      message->motor_count > BUSHD_MOTORS_PER_MCU) {
    return false;
  }
  const uint16_t own = (uint16_t)((UINT32_C(1) << message->motor_count) - 1u);
  return (message->motors & ~own) == 0;
}

bushd_status bushd_decode_report(const uint8_t* payload, size_t size, bushd_report* message) {
  reader r = read_from(payload, size);
  {
    bushd_report* const to = message;
    BUSHD_REPORT_BASE(GET)
    if ((to->sections & ~BUSHD_TELLS_ALL) != 0) return BUSHD_E_FORMAT;
    if (to->number == 0) {
      if (to->sections != 0 || to->motors != 0) return BUSHD_E_FORMAT;
      return finish(&r, to->state <= BUSHD_STATE_FAULT);
    }
    bushd_report_rest(to);
    BUSHD_REPORT_SECTIONS(GET_SECTION)
  }
  bushd_motor_report* to = message->motor;
  for (uint16_t left = message->motors; left != 0; left = (uint16_t)(left >> 1), ++to) {
    if ((left & 1u) == 0) continue;
    BUSHD_REPORT_MOTOR(GET)
  }
  return finish(&r, in_range(message));
}

bool bushd_report_is_whole(const bushd_report* message) {
  const uint16_t own = (uint16_t)((UINT32_C(1) << message->motor_count) - 1u);
  return message->number != 0 && message->sections == BUSHD_TELLS_ALL && message->motors == own;
}
