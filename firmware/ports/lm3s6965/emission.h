// Slot buffers onto the pins. Timer 1 begins a tick, timer 0 then comes every half slot: pulses
// begin and end by turns.
//
//     a tick of L cycles that begins at S:  slot k at about  S + k (L - margin) / slots
//
// Every tick's beginning is counted from that of the one before, not from when its interrupt came;
// the margin is for what interrupts are late by, so that a tick is over before the next one begins.
//
// The core learns of a new tick when the main loop comes to it (emission_begun, emission_swap);
// meanwhile its slot_buffer, prepared a tick ago, is emitted. If no slot_buffer is ready when it is
// wanted, an empty tick follows: no step is lost and none is half prepared, but the MCU falls
// behind the bus by a tick, which the next SYNC shows (fault 4).
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_EMISSION_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_EMISSION_H

#include "firmware/core/mcu.h"

#define EMISSION_SLOTS 128u
// Shorter, half slots would not hold their interrupts.
#define EMISSION_MIN_TICK_NS 250000u
// What a pulse may begin late by, but not end: 60 cycles in which another interrupt runs or none is
// let through, then the trigger's, 45, and that of a byte, 120, which go before it; and the changes
// from one to the next. Counted by the data sheet, from RAM twice.
#define EMISSION_LATE_NS 5000

// All of these are for the main loop only, with interrupts on unless it says otherwise.

// The first tick begins, one without steps. With interrupts off, after set_tick.
void emission_start(void);

// Where STEP of the outputs and the common DIR rest: true is high. While nothing moves.
void emission_set_rest(uint16_t step, bool common_dir);

// The slot_buffer of the next tick is prepared.
void emission_ready(const bushd_slot_buffer* slot_buffer);

// The tick after the core's present one has begun, at *start.
bool emission_begun(uint32_t* start);
// The core's present tick is this one; before bushd_mcu_swap.
void emission_swap(void);
// How far the core's present tick has gone at `time` (clock.h), in ns.
uint32_t emission_time_in_tick_ns(uint32_t time);

// As in bushd_port.
void emission_set_tick(uint32_t tick_ns);
void emission_adjust_tick(int32_t ns);

#endif
