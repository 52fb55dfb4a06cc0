// Parts of the port's `static bushd_mcu mcu` as symbols of the ELF, mcu.NAME: for memory_owners and
// for who watches memory. They cost no byte.
#ifndef BUSHD_FIRMWARE_PORTS_MEMORY_NAMES_H
#define BUSHD_FIRMWARE_PORTS_MEMORY_NAMES_H

#include <stddef.h>

#include "firmware/core/mcu_state.h"

// For use within a function.
#define NAME_BYTES(name, at, size)                                                     \
  __asm__ volatile(".global mcu." name "\n.set mcu." name ", mcu+%c0\n.type mcu." name \
                   ", %%object\n.size mcu." name ", %c1" ::"i"(at),                    \
                   "i"(size))
#define NAME_PART(name, part) \
  NAME_BYTES(name, offsetof(bushd_mcu, part), sizeof((bushd_mcu*)0)->part)

static inline void name_parts_of_core(void) {
  NAME_PART("receiver", receiver);
  NAME_PART("receiver.buffer", receiver.buffer);
  NAME_PART("answer", answer);
  NAME_PART("rows", stream.rows);
  NAME_PART("config", config);
  NAME_PART("config.outputs", config.outputs);
  NAME_PART("slot_buffers", slot_buffer);
  NAME_PART("motors", motor);
  NAME_PART("tables", tables);
}

#endif
