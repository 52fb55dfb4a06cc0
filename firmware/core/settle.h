// How long the supply current needs after a step; of staggered emission.
#ifndef BUSHD_FIRMWARE_CORE_SETTLE_H
#define BUSHD_FIRMWARE_CORE_SETTLE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct bushd_mcu bushd_mcu;

// How long the supply current needs after a step (settle.c).
typedef struct bushd_mcu_settle {
  bool done;
  bool away;
  uint8_t ticks;  // since it began; 0: not under way
  uint8_t motor;  // that makes the step
  union {
    struct {
      uint32_t sum;
      uint16_t samples;
      uint16_t lowest;
      uint16_t highest;
    } quiet;  // before the step
    struct {
      uint32_t back_ns;  // 0: not known
      uint16_t mean;     // without a step
      uint16_t fluctuation;
      uint16_t peak;  // farthest from the mean
    } step;           // from then on
  } of;
} bushd_mcu_settle;

// It is still to be measured: until then no motor may move.
bool bushd_mcu_settle_pending(const bushd_mcu* mcu);
// In every tick that is prepared: the step that is to be made for it, of which motor; 0: none.
int8_t bushd_mcu_settle_step(bushd_mcu* mcu, uint8_t* motor);
uint16_t bushd_mcu_settle_slot(const bushd_mcu* mcu);  // where it is made

#endif
