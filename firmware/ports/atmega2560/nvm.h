// Tables, assignments and settings in the EEPROM, 2 KB of them. While motors stand they are
// compared with what was written last, some bytes a millisecond; what has changed and then stays is
// written, 3.4 ms a byte. A head tells whose it is, and that it is whole:
//   0        HEAD_WHOLE; HEAD_BEGUN while it is written, 0xFF before the first time
//   1 .. 4   image_seal of the program
//   5 .. 6   size
//   7 .. 10  CRC-32
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_NVM_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_NVM_H

#include "firmware/core/nvm.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define NVM_HEAD_BYTES 11u
#define NVM_MOST_BYTES (E2END + 1u - EEPROM_NVM - NVM_HEAD_BYTES)

typedef enum nvm_found {
  NVM_NOTHING,  // or another program's
  NVM_WHOLE,
  NVM_BROKEN  // its writing was interrupted, or a byte has changed
} nvm_found;

// With interrupts off.
nvm_found nvm_find(void);
// The first that is kept, for bushd_mcu_config. Precondition: it is whole.
bushd_set_outputs nvm_outputs(void);
// Precondition: it is whole, and the MCU has just booted.
void nvm_load(bushd_mcu* mcu);

// Goes on with it by one byte. Precondition: the EEPROM writes nothing, and no motor moves.
void nvm_poll(bushd_mcu* mcu);

#endif
