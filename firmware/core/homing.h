// HOME: a motor that looks for its switch by itself.
#ifndef BUSHD_FIRMWARE_CORE_HOMING_H
#define BUSHD_FIRMWARE_CORE_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "engine/table.h"

typedef struct bushd_mcu bushd_mcu;

typedef struct bushd_mcu_homing {
  uint8_t stage;  // bushd_homing
  uint8_t motor;
  int8_t direction;            // towards the switch
  uint8_t readings;            // of it in a row, as they are waited for
  bool turned : 1;             // the fast stage goes the other way: a limit came before the switch
  bool meets_limit : 1;        // it ramps down because of one
  bushd_delay shortest_delay;  // of the fast stage
  uint32_t most_steps;         // of the fast stage
  uint32_t slow_steps;         // of each slow one, at most
  int32_t home_steps;          // the position to be set
  int32_t seen_steps;          // where the motor stood at the first of the readings
  bushd_table slow;            // of a single code: its cruise delay
#if BUSHD_SLOW_RUNS
  bushd_delay slow_shortest_delay;  // beyond that code; 0: none
#endif
} bushd_mcu_homing;

void bushd_mcu_go_home(bushd_mcu* mcu, uint16_t active_inputs);  // before every tick is prepared
// A motor homes, or still makes a step of the slow stages.
bool bushd_mcu_homing_in_use(const bushd_mcu* mcu);
// The one that homes goes into a limit that is not the switch it looks for. `cuts`: it stops there
// without another step; otherwise it ramps down.
void bushd_mcu_homing_meets_limit(bushd_mcu* mcu, bool cuts);

#endif
