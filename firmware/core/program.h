// Programs: frames that the MCU carries out by itself (engine/program.h).
#ifndef BUSHD_FIRMWARE_CORE_PROGRAM_H
#define BUSHD_FIRMWARE_CORE_PROGRAM_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "engine/program.h"

// 0: a small MCU has no room for any of it, nor for codes as they are written.
#ifndef BUSHD_PROGRAMS
#define BUSHD_PROGRAMS 1
#endif

typedef struct bushd_mcu bushd_mcu;

// Frames, and points of a line, that begin in one tick at most: what a tick costs has a bound.
#define BUSHD_MCU_PROGRAM_BEGINS 8u
#define BUSHD_MCU_PROGRAM_FARTHEST_START 32767  // ticks ahead
// From power-on until one that begins by itself does: supplies and drivers settle, and inputs are
// heard.
#define BUSHD_MCU_PROGRAM_POWER_ON_US UINT32_C(1000000)
// These end any program; others are a matter between the MCU and its host.
#define BUSHD_MCU_PROGRAM_ENDING_FAULTS                                          \
  (BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT | \
   BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED)

typedef struct bushd_mcu_repeat {
  const uint8_t* at;    // the frame behind REPEAT
  uint16_t next_frame;  // its number
  uint16_t left;        // passes; 0: without end
} bushd_mcu_repeat;

// Memory and state, given by the port; all zero but for these two before the first boot.
typedef struct bushd_mcu_program {
  uint8_t* bytes;
  uint16_t memory;
  uint16_t size;      // of the whole program
  uint16_t received;  // of it; parts come in order
  uint8_t stage;      // bushd_program_stage
  uint8_t reason;
  uint8_t number;
  uint16_t motors;  // that it has, from RUN until it has ended
  uint16_t moving;  // of them: those whose run of this frame is not over
  uint32_t crc;
  bushd_program program;
  const uint8_t* at;  // the next frame
  uint16_t next_frame;
  uint16_t point;
  bushd_program_frame frame;  // the present one
  bool has_frame : 1;         // one is under way
  bool pulsed : 1;
  bool met : 1;  // MOVE_UNTIL: the input has shown its level
  bool resumes : 1;
  uint8_t depth;
  bushd_mcu_repeat repeat[BUSHD_PROGRAM_MOST_DEPTH];
  uint32_t repeats;
  uint32_t start_tick;
  uint16_t kept_bytes;   // of it, over resets: all or none (nvm.h)
  uint8_t scans_before;  // that must end before one tells whether it is stored
  bool stored : 1;
  uint32_t until;  // uptime at which WAIT is over; while it pauses: how many ticks are left
  int32_t target_steps[BUSHD_MOTORS_PER_MCU];  // of the present motion
  int32_t origin_steps[BUSHD_MOTORS_PER_MCU];  // from where its range counts
} bushd_mcu_program;

void bushd_mcu_boot_program(bushd_mcu* mcu);
// What outlived the reset is there again. One that begins at power-on does, if power was off.
void bushd_mcu_restore_program(bushd_mcu* mcu);
// All that is kept has been compared with what would be there after a reset.
void bushd_mcu_program_compared(bushd_mcu* mcu, bool same);
bushd_program_state bushd_mcu_state_of_program(const bushd_mcu* mcu);

#endif
