// Tables, assignments, settings and a program in flash, up to 30 KB of them. While motors stand
// they are compared with what was written last; what has changed and then stays is written behind
// that, from the next page on, 20 us a word. Pages are erased at boot only, where nobody minds that
// the CPU stands for 20 ms.
//
// A writing is a head of five words and the content. The head comes last; its check tells that all
// is there, so one that was cut off counts for nothing, and the one before is in use.
//     0 image_seal of the program   1 number, counted up   2 size of the content in bytes
//     3 its CRC-32                  4 check: ~(0 ^ 1 ^ 2 ^ 3)
//
// At boot there is made room for one of the largest. When there is none left, what changes is not
// kept until after the next boot.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_NVM_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_NVM_H

#include "firmware/core/nvm.h"

typedef enum nvm_found {
  NVM_NOTHING,  // or another program's
  NVM_WHOLE,
  NVM_BROKEN  // a bit has changed
} nvm_found;

// Once, at boot.
nvm_found nvm_find(void);
// The first that is kept, for bushd_mcu_config. Precondition: it is whole.
bushd_set_outputs nvm_outputs(void);
// Precondition: it is whole, and the MCU has just booted.
void nvm_load(bushd_mcu* mcu);

// Goes on with it, for 20 us at most. Precondition: no motor moves.
void nvm_poll(bushd_mcu* mcu);

#endif
