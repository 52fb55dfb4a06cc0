// bushd_run_part and bushd_run_spans (engine/run_slots.h), bushd_line_follower
// (engine/line_follower.h), for run_parts.S and line_follower.S.
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

#define SPAN_FIRST 0
#define SPAN_PART 4
#define SPAN_SIZE 8
#define SPANS_STEP 0
#define SPANS_PARTS 4
#define SPANS_MASKS 6
#define SPANS_COUNT 10
#define SPANS_SPAN 11

#define FOLLOWER_INCREMENT 0
#define FOLLOWER_DUE_STEP 4
#define FOLLOWER_LEAD 8
#define FOLLOWER_APART_STEPS 12
#define FOLLOWER_APART_LATE 16
#define FOLLOWER_DUE_PART 20
#define FOLLOWER_APART_PARTS 21

#ifndef __ASSEMBLER__

#include <stddef.h>

#include "engine/line_follower.h"
#include "engine/run_slots.h"

_Static_assert(offsetof(bushd_run_part, place) == PART_PLACE, "");
_Static_assert(offsetof(bushd_run_part, rate) == PART_RATE, "");
_Static_assert(offsetof(bushd_run_part, code) == PART_CODE, "");
_Static_assert(offsetof(bushd_run_part, masks) == PART_MASKS, "");
_Static_assert(offsetof(bushd_run_part, bit) == PART_BIT, "");
_Static_assert(offsetof(bushd_run_part, since) == PART_SINCE, "");
_Static_assert(offsetof(bushd_run_part, delay) == PART_DELAY, "");
_Static_assert(offsetof(bushd_run_part, left) == PART_LEFT, "");
_Static_assert(offsetof(bushd_run_span, first) == SPAN_FIRST, "");
_Static_assert(offsetof(bushd_run_span, part) == SPAN_PART, "");
_Static_assert(sizeof(bushd_run_span) == SPAN_SIZE, "");
_Static_assert(offsetof(bushd_run_spans, step) == SPANS_STEP, "");
_Static_assert(offsetof(bushd_run_spans, parts) == SPANS_PARTS, "");
_Static_assert(offsetof(bushd_run_spans, masks) == SPANS_MASKS, "");
_Static_assert(offsetof(bushd_run_spans, count) == SPANS_COUNT, "");
_Static_assert(offsetof(bushd_run_spans, span) == SPANS_SPAN, "");
_Static_assert(offsetof(bushd_line_follower, increment) == FOLLOWER_INCREMENT, "");
_Static_assert(offsetof(bushd_line_follower, due_step) == FOLLOWER_DUE_STEP, "");
_Static_assert(offsetof(bushd_line_follower, lead) == FOLLOWER_LEAD, "");
_Static_assert(offsetof(bushd_line_follower, apart_steps) == FOLLOWER_APART_STEPS, "");
_Static_assert(offsetof(bushd_line_follower, apart_late) == FOLLOWER_APART_LATE, "");
_Static_assert(offsetof(bushd_line_follower, due_part) == FOLLOWER_DUE_PART, "");
_Static_assert(offsetof(bushd_line_follower, apart_parts) == FOLLOWER_APART_PARTS, "");

#endif
#endif
