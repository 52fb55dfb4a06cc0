/* Looks at every access of the image to memory, by callbacks that QEMU's translator puts behind
 * loads and stores. Which source file may write which object, and where code of which file is, it
 * is told (memory_map.h): source files are numbers, and bits. */
#ifndef BUSHD_LIB_SIM_QEMU_WATCH_H
#define BUSHD_LIB_SIM_QEMU_WATCH_H

#include <stdint.h>

#include "sim/qemu/qemu_api.h"

#define WATCH_UNITS 64u

typedef struct watch_violation {
  uint32_t kind; /* lockstep_violation */
  uint32_t address;
  uint32_t pc;
  uint32_t caller; /* of the library's code at pc; 0: it is not the library's */
} watch_violation;

/* `violated` does not return. */
void watch_install(qemu_plugin_id_t id, void (*violated)(const watch_violation* violation));

/* Before the first instruction. Code that is nobody's is the library's: what it writes is written
 * by who called it. */
void watch_code(uint32_t address, uint32_t size, uint8_t unit);
/* Memory that these files may write, and everybody read; what is said later counts. */
void watch_object(uint32_t address, uint32_t size, uint64_t writers);
/* From this instruction on: what comes before has RAM to itself. */
void watch_from(uint32_t address);

#endif
