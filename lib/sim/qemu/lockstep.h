// What QemuMcu and the machine in QEMU's process (machine.c) say to each other over a socket. QEMU
// stands still until it is told how far it may run, and says what happened on the way.
#ifndef BUSHD_LIB_SIM_QEMU_LOCKSTEP_H
#define BUSHD_LIB_SIM_QEMU_LOCKSTEP_H

#include <stdint.h>

typedef enum lockstep_command_kind {
  // Until time_ns, or, if value is 1, until its UART takes a byte; answered by events, the last one
  // LOCKSTEP_STOPPED
  LOCKSTEP_RUN = 1,
  LOCKSTEP_BYTE = 2,         // value: its stop bit ends at time_ns, in the order of their times
  LOCKSTEP_INPUTS = 3,       // value: levels of the motors' inputs; address: those of the system's
  LOCKSTEP_CURRENT = 4,      // value: what its ADC reads; in answer to LOCKSTEP_CONVERTS
  LOCKSTEP_FLASH = 5,        // value: the word at `address`, before the first RUN
  LOCKSTEP_RESET_CAUSE = 6,  // value: RESC, before the first RUN
  LOCKSTEP_STOP_TICKS = 7,   // the timer that begins ticks interrupts no more
  LOCKSTEP_STICK = 8,        // bit 0 of the word of RAM at `address` is 1, before the first RUN
  LOCKSTEP_KEPT_RAM = 9,     // value: the first word of RAM, before the first RUN
  LOCKSTEP_WEAR_FLASH = 10,  // what is written to flash changes nothing
  LOCKSTEP_STICK_INPUTS = 11,  // the data line of the motors' inputs is high
  // What is watched (watch.h), before the first RUN:
  LOCKSTEP_WATCH_CODE = 12,    // at `address`, `value` bytes; time_ns: whose it is
  LOCKSTEP_WATCH_OBJECT = 13,  // at `address`, `value` bytes; time_ns: who may write it, as bits
  LOCKSTEP_WATCH_FROM = 14,    // the instruction at `address` on
  LOCKSTEP_POKE = 15           // value: from now on the halfword of the program at `address`
} lockstep_command_kind;

typedef enum lockstep_event_kind {
  LOCKSTEP_STOPPED = 1,        // value: 1 if the timer of the line runs
  LOCKSTEP_STEP = 2,           // value: level, address: motor
  LOCKSTEP_DIRECTIONS = 3,     // value: levels of the 74HC595's outputs, bit per motor
  LOCKSTEP_ENABLE = 4,         // value: level
  LOCKSTEP_DRIVER_ENABLE = 5,  // value: level; address: 1 if the UART is sending
  LOCKSTEP_SENT = 6,           // value: a byte that its UART took at this time
  LOCKSTEP_OVERRUN = 7,        // a byte was lost in its UART
  LOCKSTEP_STORED = 8,         // value: the flash word at `address` is this now
  LOCKSTEP_WATCHDOG = 9,       // it is reset, and the process ends; value: the first word of RAM
  LOCKSTEP_COMMON_DIR = 10,    // value: level
  LOCKSTEP_COMPARE = 11,       // value: level
  LOCKSTEP_CONVERTS = 12,      // its ADC begins a conversion, and waits for LOCKSTEP_CURRENT
  LOCKSTEP_VIOLATION = 13      // value: lockstep_violation; `address` of memory; pc and caller:
                               // watch.h. The process ends
} lockstep_event_kind;

typedef enum lockstep_violation {
  LOCKSTEP_WRITES_FOREIGN = 1,  // an object of others
  LOCKSTEP_WRITES_GAP = 2,      // what is no object, nor the stack
  LOCKSTEP_WRITES_NOWHERE = 3,  // beyond RAM and registers
  LOCKSTEP_READS_GAP = 4,
  LOCKSTEP_READS_NOWHERE = 5,  // beyond flash, RAM and registers
  LOCKSTEP_STORES_FOREIGN = 6  // flash that is not for writing
} lockstep_violation;

typedef struct lockstep_message {
  int64_t time_ns;  // since its first instruction
  uint32_t kind;
  uint32_t value;
  uint32_t address;
  uint32_t pc;
  uint32_t caller;
  uint32_t unused;
} lockstep_message;

#endif
