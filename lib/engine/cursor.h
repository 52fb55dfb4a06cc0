// Reading and writing payloads field by field; for the message files of the engine only.
#ifndef BUSHD_ENGINE_CURSOR_H
#define BUSHD_ENGINE_CURSOR_H

#include "engine/message.h"

// A cursor over a payload. Reading beyond the end yields zeros and is remembered, so that a decoder
// reads its fields in a row and asks once.
typedef struct reader {
  const uint8_t* at;
  const uint8_t* end;
  bool short_of_bytes;
} reader;

// NULL: there are not as many.
static inline const uint8_t* take(reader* r, size_t size) {
  if (r->short_of_bytes || (size_t)(r->end - r->at) < size) {
    r->short_of_bytes = true;
    return NULL;
  }
  const uint8_t* const at = r->at;
  r->at += size;
  return at;
}
static inline uint8_t get8(reader* r) {
  const uint8_t* const at = take(r, 1);
  return at != NULL ? *at : 0;
}
static inline uint16_t get16(reader* r) {
  const uint8_t* const at = take(r, 2);
  return at != NULL ? bushd_get_u16(at) : 0;
}
static inline uint32_t get32(reader* r) {
  const uint8_t* const at = take(r, 4);
  return at != NULL ? bushd_get_u32(at) : 0;
}
static inline reader read_from(const uint8_t* payload, size_t size) {
  const reader r = {payload, payload + size, false};
  return r;
}
// The whole payload and nothing else must have been read; then the ranges count.
static inline bushd_status finish(const reader* r, bool in_range) {
  if (r->short_of_bytes || r->at != r->end) return BUSHD_E_LENGTH;
  return in_range ? BUSHD_OK : BUSHD_E_FORMAT;
}

typedef struct writer {
  uint8_t* at;
} writer;

static inline void put8(writer* w, uint8_t value) {
  *w->at++ = value;
}
static inline void put16(writer* w, uint16_t value) {
  bushd_put_u16(w->at, value);
  w->at += 2;
}
static inline void put32(writer* w, uint32_t value) {
  bushd_put_u32(w->at, value);
  w->at += 4;
}

#endif
