; The edges of the trigger and of the emergency input, and the position compare pulse, by the registers that interrupts have to themselves (emission_slots.h):
; slots wait for none of them longer than 25 cycles. None changes a flag of SREG.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"
#include <board.inc>

    .section .vectors, "ax", @progbits

; Each edge once, with its time.
    .global TRIGGER_VECTOR
TRIGGER_VECTOR:
    lds DATA_LOW, CLOCK_COUNT_LOW
    sts trigger_count, DATA_LOW
    lds DATA_LOW, CLOCK_COUNT_HIGH
    sts trigger_count+1, DATA_LOW
    cbi _SFR_IO_ADDR(EIMSK), TRIGGER_INT
    reti

; EN is off: its output turns over, once. It was on, or nobody would wait for this edge. Nor does it come on again when the
; watchdog bites, should the core hang: without its low byte what was kept is neither level (boot_tests.h).
    .global EMERGENCY_VECTOR
EMERGENCY_VECTOR:
    mov SAVED_LOW, r16
    ldi r16, 1 << EN_BIT
    sts _SFR_MEM_ADDR(EN_PIN), r16
    mov r16, SAVED_LOW
    sts enable_kept, ZERO
    emergency_interrupt_off
    reti

#ifdef TCNT4
; Compare A of timer 4 begins the pulse, compare B ends it. Each goes off by itself, and leaves the other as it is
; wanted: a compare comes again whenever the timer has gone round.
    .global TIMER4_COMPA_vect
TIMER4_COMPA_vect:
    sbi _SFR_IO_ADDR(COMPARE_PORT), COMPARE_BIT
    sts compare_rises, ZERO
    lds DATA_LOW, compare_falls
    sts TIMSK4, DATA_LOW
    reti

    .global TIMER4_COMPB_vect
TIMER4_COMPB_vect:
    cbi _SFR_IO_ADDR(COMPARE_PORT), COMPARE_BIT
    sts compare_falls, ZERO
    lds DATA_LOW, compare_rises
    sts TIMSK4, DATA_LOW
    reti
#endif
