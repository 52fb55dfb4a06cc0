; The slot interrupts. Compare A begins a slot and its pulses, compare B ends them, compare C comes after it in
; the last slot of a tick and in the first one of the next. None of them changes a flag of SREG. In section
; .vectors they lie behind the vectors, so that these reach them by rjmp.
;
; Cycles with entry and vector: A 23, B 16 (22 where a STEP rests high, 24 with a common DIR), and once a tick: A in the first slot 51 and in the last one 59,
; C 26 and then 16 with interrupts off.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"
#include "firmware/ports/atmega2560/emission_ticks.inc"

    .section .vectors, "ax", @progbits

    .global TIMER1_COMPA_vect
TIMER1_COMPA_vect:
    movw SAVED_LOW, r30
    movw r30, SLOT_LOW
    ld DATA_LOW, Z+
    ld DATA_HIGH, Z+
    out _SFR_IO_ADDR(STEP_LOW), DATA_LOW
    out _SFR_IO_ADDR(STEP_HIGH), DATA_HIGH
    movw SLOT_LOW, r30
    movw r30, SAVED_LOW
    end_slot last_slot
last_slot:
    begin_last_slot
    ldi r30, 1 << OCF1C
    out _SFR_IO_ADDR(TIFR1), r30
    ldi r30, 1 << OCIE1A | 1 << OCIE1B | 1 << OCIE1C
    sts TIMSK1, r30
    take_next_tick

    .global TIMER1_COMPB_vect
TIMER1_COMPB_vect:
    sbic TICK_FLAGS, TICK_SPECIAL
    rjmp special_slot
    out _SFR_IO_ADDR(STEP_LOW), ZERO
    out _SFR_IO_ADDR(STEP_HIGH), ZERO
    reti
special_slot:
    sbic TICK_FLAGS, TICK_LEVELS
    reti
    lds DATA_LOW, _SFR_MEM_ADDR(REST_LOW)
    out _SFR_IO_ADDR(STEP_LOW), DATA_LOW
    lds DATA_LOW, _SFR_MEM_ADDR(REST_HIGH)
    out _SFR_IO_ADDR(STEP_HIGH), DATA_LOW
    sbis TICK_FLAGS, TICK_COMMON
    reti
    ; A one turns the pin over.
    sbi _SFR_IO_ADDR(COMMON_DIR_PIN), COMMON_DIR_BIT
    reti

    .global TIMER1_COMPC_vect
TIMER1_COMPC_vect:
    sbis TICK_FLAGS, TICK_IS_NEXT
    rjmp tell_main_loop
    ; The tick's last pulses are over: DIR may change.
    movw SAVED_LOW, r30
    point_to_taken
    ldd DATA_LOW, Z+TICK_DIRECTION
    sts _SFR_MEM_ADDR(DIR_LOW), DATA_LOW
    ldd DATA_LOW, Z+TICK_DIRECTION+1
    out _SFR_IO_ADDR(DIR_HIGH), DATA_LOW
    movw r30, SAVED_LOW
    reti
tell_main_loop:
    push r24
    ldi r24, 1 << OCIE1A | 1 << OCIE1B
    sts TIMSK1, r24
    sei
    in r24, _SFR_IO_ADDR(SREG)
    push r24
    push r30
    push r31
    push r25
    point_to_taken
    tell_tick 2
    pop r25
    pop r31
    pop r30
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    reti

    .text

    .global emission_set_registers
emission_set_registers:
    set_slot_registers
    ret
