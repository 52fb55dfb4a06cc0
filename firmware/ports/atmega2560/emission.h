// Slot buffers onto the pins. Timer 1 counts the cycles of a slot: compare A begins its pulses,
// compare B ends them.
//
//     slot k of a tick of L cycles begins at  start + k floor(L / slots)
//
// and the last one takes the rest.
//
// The core learns of a new tick when the main loop comes to it (emission_begun, emission_swap);
// meanwhile its slot_buffer, prepared a tick ago, is emitted. If no slot_buffer is ready when it is
// wanted, an empty tick follows: no step is lost and none is half prepared, but the MCU falls
// behind the bus by a tick, which the next SYNC shows (fault 4).
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_H

#include "firmware/core/mcu.h"

#define EMISSION_SLOTS 128u
// STEP pulses last as long at least.
#define EMISSION_PULSE_NS 2500
// Half of what the report takes, the most that a frame asks for at once: so the
// next tick begins at most this late. A whole report would leave no room for frames in the shortest
// ticks.
#define EMISSION_FRAME_CYCLES 3800u

// All of these are for the main loop only.

// The first tick begins, one without steps. With interrupts off, after set_tick; slots are late if
// they stay off.
void emission_start(void);

// Where STEP of the outputs rests: 1 is high. While nothing moves.
void emission_set_rest(uint16_t step);

// The slot_buffer of the next tick is prepared. Its masks become levels where STEP rests high.
void emission_ready(bushd_slot_buffer* slot_buffer);

// The tick after the core's present one has begun.
bool emission_begun(void);
// It will within EMISSION_FRAME_CYCLES.
bool emission_begins_soon(void);
// The core's present tick is this one; before bushd_mcu_swap.
void emission_swap(void);
// When a slot begins of the slot_buffer that was given last, if no other tick comes before it.
uint32_t emission_slot_time(uint16_t slot);
// How far the core's present tick has gone at `time` (clock.h), in ns; before it: negative.
int32_t emission_time_in_tick_ns(uint32_t time);

// As in bushd_port.
void emission_set_tick(uint32_t tick_ns);
void emission_adjust_tick(int32_t ns);

#endif
