// LOCAL: motors that people move by two buttons at the MCU, or by a keypad (keypad.h).
#ifndef BUSHD_FIRMWARE_CORE_LOCAL_H
#define BUSHD_FIRMWARE_CORE_LOCAL_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "firmware/core/keypad.h"

typedef struct bushd_mcu bushd_mcu;

#define BUSHD_MCU_LOCAL_READINGS 3u  // of a press, before it counts

typedef struct bushd_mcu_local {
  bushd_local settings;
  uint16_t held;         // motors that the button has moved or will move, until it is released
  int8_t wish;           // +1, -1; 0: none, or both
  bool by_keypad : 1;    // who wishes it
  bool configuring : 1;  // a part of a configuration is there: nothing moves until LOCAL ends it
  uint8_t readings;      // since it changed
  bushd_mcu_keypad pad;
} bushd_mcu_local;

// A master configures: what is to move, by which switches and how is not all there before LOCAL.
// If it never comes, as to an MCU that does not know it, nothing moves, and what is kept stays.
void bushd_mcu_wait_for_local(bushd_mcu* mcu);
void bushd_mcu_move_locally(bushd_mcu* mcu, uint8_t system_inputs);  // before every tick
// What is active now counts only after it was released. No motor may be moved by it.
void bushd_mcu_forget_presses(bushd_mcu* mcu, uint8_t system_inputs);

#endif
