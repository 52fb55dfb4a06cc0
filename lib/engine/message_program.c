#include "engine/message_program.h"

#include "engine/cursor.h"

size_t bushd_encode_program_put(const bushd_program_put* message, uint8_t* payload) {
  writer w = {payload};
  put16(&w, message->offset);
  put16(&w, message->total);
  for (uint8_t i = 0; i < message->count; ++i) put8(&w, message->bytes[i]);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_program_put(const uint8_t* payload, size_t size,
                                      bushd_program_put* message) {
  reader r = read_from(payload, size);
  message->offset = get16(&r);
  message->total = get16(&r);
  message->bytes = r.at;
  const size_t count = (size_t)(r.end - r.at);
  if (count == 0 || count > BUSHD_PROGRAM_PUT_MAX) return BUSHD_E_LENGTH;
  message->count = (uint8_t)count;
  take(&r, count);
  if ((uint32_t)message->offset + count > message->total) return BUSHD_E_LENGTH;
  return finish(&r, true);
}

size_t bushd_encode_program_control(const bushd_program_control* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->action);
  put8(&w, message->number);
  put32(&w, message->value);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_program_control(const uint8_t* payload, size_t size,
                                          bushd_program_control* message) {
  reader r = read_from(payload, size);
  message->action = get8(&r);
  message->number = get8(&r);
  message->value = get32(&r);
  bool in_range = (message->number != 0) == (message->action == BUSHD_PROGRAM_RUN);
  switch (message->action) {
    case BUSHD_PROGRAM_COMMIT:
    case BUSHD_PROGRAM_RUN:
      break;
    case BUSHD_PROGRAM_STOP:
      in_range = in_range && message->value <= BUSHD_STOP_IMMEDIATE;
      break;
    default:
      in_range = in_range && message->action <= BUSHD_PROGRAM_RESUME && message->value == 0;
  }
  return finish(&r, in_range);
}

size_t bushd_encode_program_state(const bushd_program_state* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->stage);
  put8(&w, message->reason);
  put8(&w, message->number);
  put8(&w, message->flags);
  put16(&w, message->motors);
  put16(&w, message->memory);
  put16(&w, message->size);
  put32(&w, message->crc);
  put16(&w, message->frame);
  put16(&w, message->point);
  put32(&w, message->repeats);
  put32(&w, message->start_tick);
  put32(&w, message->tick);
  return (size_t)(w.at - payload);
}

bushd_status bushd_decode_program_state(const uint8_t* payload, size_t size,
                                        bushd_program_state* message) {
  reader r = read_from(payload, size);
  message->stage = get8(&r);
  message->reason = get8(&r);
  message->number = get8(&r);
  message->flags = get8(&r);
  message->motors = get16(&r);
  message->memory = get16(&r);
  message->size = get16(&r);
  message->crc = get32(&r);
  message->frame = get16(&r);
  message->point = get16(&r);
  message->repeats = get32(&r);
  message->start_tick = get32(&r);
  message->tick = get32(&r);
  return finish(&r, message->stage <= BUSHD_PROGRAM_ENDED &&
                        message->reason <= BUSHD_PROGRAM_TRAVELLED &&
                        message->size <= message->memory);
}
