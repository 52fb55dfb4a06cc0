#include "firmware/core/keypad.h"

#include "firmware/core/mcu_state.h"

enum { FORWARD = 0x00, REVERSE = 0xFF, SLOWER = 0xFE, STOP = 0xFD };
enum { TEXT = 5, CHANGES = (BUSHD_KEYPAD_LAST - BUSHD_KEYPAD_FIRST) / BUSHD_KEYPAD_CHANGE };

_Static_assert(CHANGES < 0x7F, "counted in seven bits");

static uint16_t delay_of(const bushd_mcu_keypad* keypad) {
  return (uint16_t)(BUSHD_KEYPAD_FIRST + keypad->slower * BUSHD_KEYPAD_CHANGE);
}

void bushd_mcu_keypad_byte(bushd_mcu* mcu, uint8_t byte) {
  bushd_mcu_keypad* keypad = &mcu->local.pad;
  if (mcu->local.settings.keypad == 0) return;
  switch (byte) {
    case FORWARD:
    case REVERSE:
      if (!keypad->waits_for_release) keypad->direction = byte == FORWARD ? 1 : -1;
      keypad->fresh = true;
      break;
    case SLOWER:
      keypad->slower = (keypad->slower < CHANGES ? keypad->slower + 1u : 0u) & 0x7Fu;
      keypad->slowed = true;
      break;
    case STOP:
      keypad->direction = 0;
      keypad->waits_for_release = false;
      break;
    default:
      return;
  }
  keypad->refused = keypad->waits_for_release;
  keypad->due = true;
}

void bushd_mcu_keypad_break(bushd_mcu* mcu) {
  mcu->local.pad.direction = 0;
}

// Whether a key counts shows only when its motors would begin.
static bool is_settled(const bushd_mcu_local* local) {
  return local->pad.direction == 0 || (local->by_keypad && local->wish == local->pad.direction &&
                                       local->readings == BUSHD_MCU_LOCAL_READINGS);
}

int16_t bushd_mcu_keypad_display(bushd_mcu* mcu) {
  bushd_mcu_keypad* keypad = &mcu->local.pad;
  if (keypad->left == 0) {
    if (!keypad->due || !is_settled(&mcu->local)) return -1;
    keypad->due = false;
    keypad->dashes = keypad->refused;
    keypad->left = TEXT;
  }
  const uint8_t left = keypad->left;
  keypad->left = (uint8_t)(left - 1u) & 7u;
  if (left == 1) return '\n';
  if (keypad->dashes) return '-';
  uint16_t digits = delay_of(keypad);
  for (uint8_t behind = (uint8_t)(left - 2u); behind > 0; --behind) digits /= 10;
  return (int16_t)('0' + digits % 10);
}

int8_t bushd_mcu_keypad_direction(bushd_mcu* mcu) {
  bushd_mcu_keypad* keypad = &mcu->local.pad;
  // Not when its byte came: ports look at their lines at other times of a tick.
  if (keypad->fresh) keypad->heard = (uint16_t)mcu->uptime;
  keypad->fresh = false;
  const uint16_t most = mcu->local.settings.keypad_ticks;
  const uint16_t silent = (uint16_t)((uint16_t)mcu->uptime - keypad->heard);
  if (most != 0 && silent >= most) keypad->direction = 0;
  if (keypad->waits_for_release && silent >= most &&
      silent >= BUSHD_KEYPAD_RELEASE_NS / mcu->tick_ns) {
    keypad->waits_for_release = false;
  }
  return keypad->direction;
}

void bushd_mcu_keypad_wait_for_release(bushd_mcu* mcu) {
  bushd_mcu_keypad_refuse(mcu);
  mcu->local.pad.waits_for_release = true;
  mcu->local.pad.fresh = true;
}

void bushd_mcu_keypad_refuse(bushd_mcu* mcu) {
  bushd_mcu_keypad* keypad = &mcu->local.pad;
  if (keypad->direction == 0) return;
  keypad->direction = 0;
  keypad->refused = true;
  keypad->due = true;
}

uint16_t bushd_mcu_keypad_shortest_delay(const bushd_mcu* mcu, const bushd_table* table) {
  const uint32_t ns = delay_of(&mcu->local.pad) * BUSHD_KEYPAD_UNIT_NS;
  const uint32_t units = (ns - 1u) / table->time_unit_ns + 1u;
  return units < UINT16_MAX ? (uint16_t)units : UINT16_MAX;
}

int32_t bushd_mcu_keypad_speed(const bushd_mcu* mcu) {
  return (int32_t)(64u * (1000000000u / BUSHD_KEYPAD_UNIT_NS) / delay_of(&mcu->local.pad));
}
