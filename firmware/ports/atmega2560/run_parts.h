// bushd_run_part (engine/run_slots.h) for run_parts.S.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_RUN_PARTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_RUN_PARTS_H

#define PART_PLACE 0
#define PART_RATE 8
#define PART_CODE 10
#define PART_MASKS 12
#define PART_BIT 14
#define PART_SINCE 18
#define PART_DELAY 20
#define PART_LEFT 22

#ifndef __ASSEMBLER__

#include <stddef.h>

#include "engine/run_slots.h"

_Static_assert(offsetof(bushd_run_part, place) == PART_PLACE, "");
_Static_assert(offsetof(bushd_run_part, rate) == PART_RATE, "");
_Static_assert(offsetof(bushd_run_part, code) == PART_CODE, "");
_Static_assert(offsetof(bushd_run_part, masks) == PART_MASKS, "");
_Static_assert(offsetof(bushd_run_part, bit) == PART_BIT, "");
_Static_assert(offsetof(bushd_run_part, since) == PART_SINCE, "");
_Static_assert(offsetof(bushd_run_part, delay) == PART_DELAY, "");
_Static_assert(offsetof(bushd_run_part, left) == PART_LEFT, "");

#endif
#endif
