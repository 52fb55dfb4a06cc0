// The tick counter against the bus's.
#ifndef BUSHD_FIRMWARE_CORE_SYNC_H
#define BUSHD_FIRMWARE_CORE_SYNC_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// The tick counter against the bus's (sync.c). All adjustments are as the port takes them: > 0 is a
// longer tick.
typedef struct bushd_mcu_clock {
  // Ticks until the tick timer has another length; times of SYNCs are void till then.
  uint8_t settling : 2;
  bool rate_known : 1;   // estimated from an error other than 0 since the clock was adopted
  bool corrected : 1;    // the clock was right at corrected_tick of the bus
  bool other_heard : 1;  // a master that was not `master`
  bool heard : 1;        // a SYNC frame; of the last one:
  uint16_t master;       // whose it is
  uint32_t sync_id;      // its id
  uint32_t sync_tick;    // when it was, if BUSHD_FLAG_SYNC_HEARD
  uint32_t sync_ns;
  int32_t behind_ns;     // the bus, not yet given to the port
  int32_t slew_now_ns;   // of the present tick
  int32_t slew_next_ns;  // of the next one, given
  int32_t rate_now_ns;   // the rate's share in the same
  int32_t rate_next_ns;
  uint32_t told_tick;     // of the bus, that the last SYNC with a follow-up has told
  int32_t rate_ppb;       // faster than the crystal
  int32_t rate_step;      // ns a tick, x 4096
  int32_t rate_fraction;  // of it, not yet given
  uint32_t corrected_tick;
  uint32_t corrected_ns;
  // Masters that come by turns.
  uint16_t other_master;   // the last one that was not `master`
  uint32_t master_uptime;  // when they were heard last
  uint32_t other_uptime;
  uint16_t two_masters_ticks;  // until the flag falls
} bushd_mcu_clock;

void bushd_mcu_sync(bushd_mcu* mcu, const bushd_sync* sync, int32_t time_in_tick_ns);
void bushd_mcu_slew(bushd_mcu* mcu);             // at every tick boundary
void bushd_mcu_new_tick_length(bushd_mcu* mcu);  // mcu->tick_ns is another one

#endif
