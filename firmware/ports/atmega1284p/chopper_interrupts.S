; The chopper (chopper.h), by the registers that interrupts have to themselves (emission_slots.h). None changes a flag of
; SREG. Cycles with entry and vector: the period 29, a comparator 19.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"

#define WANTED DATA_HIGH  // emission_slots.S

    .section .vectors, "ax", @progbits

; A period begins. An edge of before is forgotten first, so that one that comes as soon as the windings are on is seen. A
; comparator that is low already has no other edge to come: a winding went on in the middle of the last period, when its
; pair was cut, and has more current than it should.
    .global TIMER0_COMPA_vect
TIMER0_COMPA_vect:
    movw SAVED_LOW, r30
    ldi r30, 1 << INTF0 | 1 << INTF1
    out _SFR_IO_ADDR(EIFR), r30
    movw r30, SAVED_LOW
    sbi _SFR_IO_ADDR(EIMSK), INT0
    sbi _SFR_IO_ADDR(EIMSK), INT1
    in DATA_LOW, _SFR_IO_ADDR(COMPARATORS)
    out _SFR_IO_ADDR(STEP_PORT), WANTED
    sbrs DATA_LOW, COMPARATOR_0_BIT
    rjmp cut_0
first_is_on:
    sbrs DATA_LOW, COMPARATOR_1_BIT
    rjmp cut_1
    reti
cut_0:
    cbi _SFR_IO_ADDR(STEP_PORT), 0
    cbi _SFR_IO_ADDR(STEP_PORT), 2
    rjmp first_is_on
cut_1:
    cbi _SFR_IO_ADDR(STEP_PORT), 1
    cbi _SFR_IO_ADDR(STEP_PORT), 3
    reti

    .global INT0_vect
INT0_vect:
    cbi _SFR_IO_ADDR(STEP_PORT), 0
    cbi _SFR_IO_ADDR(STEP_PORT), 2
    cbi _SFR_IO_ADDR(EIMSK), INT0
    reti

    .global INT1_vect
INT1_vect:
    cbi _SFR_IO_ADDR(STEP_PORT), 1
    cbi _SFR_IO_ADDR(STEP_PORT), 3
    cbi _SFR_IO_ADDR(EIMSK), INT1
    reti
