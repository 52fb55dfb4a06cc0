; The slot interrupts, as those of the ATmega2560 (../atmega2560/emission_slots.h), for one port of STEP or phases.
; Timer 1 has no compare C here: compare B does its work in the last slot of a tick and in the first one of the next.
; None of them changes a flag of SREG.
;
; Cycles with entry and vector: A 23, where a pulse begins 26, where windings change 51, and once a tick, in the first slot
; and in the last one, some 50; B 16, and once a tick 50 and 75.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"
#include "firmware/ports/atmega2560/emission_ticks.inc"

; What the slots want on; windings that the chopper has cut are off meanwhile.
#define WANTED DATA_HIGH
    .section .vectors, "ax", @progbits

    .global TIMER1_COMPA_vect
TIMER1_COMPA_vect:
    movw SAVED_LOW, r30
    movw r30, SLOT_LOW
    ld DATA_LOW, Z+
    cpse DATA_LOW, WANTED
    rjmp other_outputs
outputs_are_set:
    ; The byte of the second port, which this chip has not.
    ld DATA_LOW, Z+
    movw SLOT_LOW, r30
    movw r30, SAVED_LOW
    end_slot last_slot
other_outputs:
    sbic TICK_FLAGS, TICK_LEVELS
    rjmp other_windings
    out _SFR_IO_ADDR(STEP_PORT), DATA_LOW
    mov WANTED, DATA_LOW
    rjmp outputs_are_set
other_windings:
    ; Those that stay on, and that the chopper has cut in its present period, stay cut:
    ; on = wanted & (on | ~wanted before)
    push r24
    in r24, _SFR_IO_ADDR(SREG)
    push r24
    com WANTED
    in r24, _SFR_IO_ADDR(STEP_PORT)
    or r24, WANTED
    and r24, DATA_LOW
    out _SFR_IO_ADDR(STEP_PORT), r24
    ; An edge that waits is that of the winding before: it must not cut one of its pair that has just come on.
    and WANTED, DATA_LOW
    ldi r24, 0
    .irp winding, 0, 1, 2, 3
    sbrc WANTED, \winding
    ori r24, 1 << (INTF0 + (\winding & 1))
    .endr
    out _SFR_IO_ADDR(EIFR), r24
    mov WANTED, DATA_LOW
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    rjmp outputs_are_set
last_slot:
    begin_last_slot
    take_next_tick

    .global TIMER1_COMPB_vect
TIMER1_COMPB_vect:
    sbic TICK_FLAGS, TICK_LEVELS
    rjmp pulses_are_over
    in WANTED, _SFR_IO_ADDR(REST_LOW)
    out _SFR_IO_ADDR(STEP_PORT), WANTED
pulses_are_over:
    sbis TICK_FLAGS, TICK_CHANGES
    reti
    sbis TICK_FLAGS, TICK_IS_NEXT
    rjmp tell_main_loop
    ; The tick's last pulses are over: DIR may change. The SPI takes 16 cycles for a byte.
    movw SAVED_LOW, r30
    point_to_taken
    ldd DATA_LOW, Z+TICK_DIRECTION
    out _SFR_IO_ADDR(SPDR), DATA_LOW
    movw r30, SAVED_LOW
    .rept 10
    rjmp .
    .endr
    sbi _SFR_IO_ADDR(DIR_LATCH_PORT), DIR_LATCH_BIT
    cbi _SFR_IO_ADDR(DIR_LATCH_PORT), DIR_LATCH_BIT
    reti
tell_main_loop:
    push r24
    in r24, _SFR_IO_ADDR(SREG)
    push r24
    push r25
    movw SAVED_LOW, r30
    point_to_taken
    tell_tick 1
    movw r30, SAVED_LOW
    pop r25
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    reti

    .text

    .global emission_set_registers
emission_set_registers:
    set_slot_registers
    in WANTED, _SFR_IO_ADDR(REST_LOW)
    ret
