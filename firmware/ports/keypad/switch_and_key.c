// The other node of the source documents: PC0 is a switch for the direction, open forward, closed
// reverse; PC1 is the speed key. The motor moves as long as there is no reason against it, and each
// press sends the byte of "slower": to an MCU with the delays of this keypad it is the next faster
// speed, and after the last one the first.
//
// When power comes nothing moves until the switch is turned or the key pressed. A key that is held
// for a second stops the motor, until the next time.
#include "firmware/ports/keypad/keys.h"

enum { SWITCH = 1, SPEED = 2, HELD_MS = 1000 };

static bool say(wish* w, key_byte byte, bool is_new) {
  w->byte = byte;
  w->is_new = is_new;
  return true;
}

static bool say_direction(keys* k, wish* w, bool is_new) {
  k->moves = true;
  k->repeat_ms = 0;
  return say(w, (k->counts & SWITCH) != 0 ? REVERSE : FORWARD, is_new);
}

bool keys_follow(keys* k, uint8_t closed, bool line_is_free, wish* w) {
  closed &= SWITCH | SPEED;
  if (k->repeat_ms < REPEAT_MS) ++k->repeat_ms;
  if (!k->begun) {
    // What is closed now may be stuck.
    k->counts = closed;
    k->held_ms = HELD_MS;
    k->begun = true;
    return false;
  }
  const bool was_held = (k->counts & SPEED) != 0;
  const bool is_held = (closed & SPEED) != 0;
  if (is_held && was_held && k->held_ms < HELD_MS) ++k->held_ms;
  if (!line_is_free) return false;
  const uint8_t changed = closed ^ k->counts;
  k->counts = closed;
  if ((changed & SWITCH) != 0) return say_direction(k, w, true);
  if (is_held && !was_held) k->held_ms = 0;
  if (is_held && k->held_ms == HELD_MS - 1 && k->moves) {
    k->held_ms = HELD_MS;
    k->moves = false;
    return say(w, STOP, true);
  }
  if (was_held && !is_held && k->held_ms < HELD_MS - 1) {
    return k->moves ? say(w, SLOWER, true) : say_direction(k, w, true);
  }
  return k->moves && k->repeat_ms == REPEAT_MS && say_direction(k, w, false);
}
