// The four keys of the source document: PC0 forward, PC1 reverse, PC2 slower, PC3 stop. A key sends
// its byte when it is pressed; a direction is sent again as long as its key is held.
//
// Several keys at once stop the motor. What is left of them when one is released means nothing, nor
// does what is held when power comes: it may be stuck.
#include "firmware/ports/keypad/keys.h"

static bool is_one(uint8_t closed) {
  return (closed & (closed - 1u)) == 0;
}

static key_byte byte_of(uint8_t closed) {
  if (closed == 1) return FORWARD;
  if (closed == 2) return REVERSE;
  return closed == 4 ? SLOWER : STOP;
}

bool keys_follow(keys* k, uint8_t closed, bool line_is_free, wish* w) {
  if (k->repeat_ms < REPEAT_MS) ++k->repeat_ms;
  if (!k->begun) {
    k->begun = closed == 0;
    return false;
  }
  w->byte = byte_of(closed);
  w->is_new = closed != k->counts;
  const bool is_direction = closed == 1 || closed == 2;
  const bool again = is_direction && k->repeat_ms == REPEAT_MS;
  if (!line_is_free || (!w->is_new && !again)) return false;
  k->counts = closed;
  k->repeat_ms = 0;
  if (!is_one(closed)) k->begun = false;
  return closed != 0;
}
