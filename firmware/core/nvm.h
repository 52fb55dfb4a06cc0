// What outlives a reset, if the port keeps it.
#ifndef BUSHD_FIRMWARE_CORE_NVM_H
#define BUSHD_FIRMWARE_CORE_NVM_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/core/mcu_state.h"

#ifdef __cplusplus
extern "C" {
#endif

// What a port may keep over resets: pieces of memory, from index 0 on until one is empty. Later
// ones may be as long as earlier ones say. The first one is bushd_mcu_config.outputs, which a port
// reads before bushd_mcu_boot too. They hold addresses: only the same program may get them
// back, between bushd_mcu_boot and the first tick, the earlier ones first, and then
// bushd_mcu_nvm_restored.
typedef struct bushd_mcu_nvm_region {
  void* at;
  uint16_t size;
} bushd_mcu_nvm_region;
bushd_mcu_nvm_region bushd_mcu_nvm_region_at(bushd_mcu* mcu, uint8_t index);
// Bytes of all pieces together but the program's, with this much table memory and all motors.
#define BUSHD_MCU_NVM_MAX_BYTES(code_count)                                                     \
  (sizeof(bushd_set_outputs) + sizeof(uint32_t) + sizeof(bushd_format) +                        \
   sizeof(bushd_set_inputs) + BUSHD_MOTORS_PER_MCU * sizeof(bushd_mcu_switches) +               \
   sizeof(bushd_emission) + sizeof(bushd_local) + BUSHD_TABLE_BANKS * sizeof(bushd_mcu_table) + \
   sizeof(uint8_t) + sizeof(uint16_t) + (code_count) * sizeof(uint16_t) +                       \
   BUSHD_MOTORS_PER_MCU * sizeof(int8_t) + BUSHD_MAX_CURRENT_MOTORS * sizeof(bushd_currents) +  \
   BUSHD_MAX_VELOCITY_MOTORS * sizeof(bushd_mcu_velocity_settings))
// The program's, with bushd_mcu_config.keeps_programs.
#define BUSHD_MCU_NVM_PROGRAM_BYTES(memory) (sizeof(uint16_t) + (memory))
void bushd_mcu_nvm_restored(bushd_mcu* mcu);
// A scan has ended: whether all pieces are as they would be after a reset now.
void bushd_mcu_nvm_compared(bushd_mcu* mcu, bool same);

// For a port that goes through all pieces a little at a time, again and again.
typedef struct bushd_mcu_nvm_scan {
  uint8_t index;  // of the piece
  uint16_t offset;
  uint16_t size;         // of all bytes so far
  uint32_t crc;          // register after them
  uint32_t crc_before;   // of the scan before
  uint16_t same_uptime;  // since when it is the same
} bushd_mcu_nvm_scan;
void bushd_mcu_nvm_begin_scan(bushd_mcu_nvm_scan* scan);
// The next bytes, up to `most` (>= 1); empty at the end. Pieces may change between two calls: of
// one that has become shorter than the scan has come, nothing is left. Never more bytes in all than
// the two macros above say.
bushd_mcu_nvm_region bushd_mcu_nvm_scan_next(bushd_mcu* mcu, bushd_mcu_nvm_scan* scan,
                                             uint16_t most);
// At the end of a scan: whether what is kept has stayed the same for so long that it may be
// written. A master that begins changes one thing after the other.
bool bushd_mcu_nvm_is_quiet(const bushd_mcu* mcu, bushd_mcu_nvm_scan* scan);

#ifdef __cplusplus
}
#endif
#endif
