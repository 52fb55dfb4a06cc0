; The slot interrupts, as those of the ATmega2560 (../atmega2560/emission_slots.h), for one port of STEP or phases.
; Timer 1 has no compare C here: compare B does its work in the last slot of a tick and in the first one of the next.
; None of them changes a flag of SREG.
;
; Cycles with entry and vector: A 23, where a pulse begins 26, where windings change 51, and once a tick, in the first slot
; and in the last one, some 50; B 16, and once a tick 50 and 75.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"

; What the slots want on; windings that the chopper has cut are off meanwhile.
#define WANTED DATA_HIGH
#define TICK_FLAGS _SFR_IO_ADDR(GPIOR0)

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
    cpse SLOT_LOW, SLOT_MARK
    reti
    sbis TICK_FLAGS, TICK_IS_NEXT
    rjmp take_next_tick
    ; The first slot: timer 1 has begun it with the length of the one before.
    lds r30, emission_taken
    ldi r31, hi8(emission_silent)
    ldd DATA_LOW, Z+TICK_BEGUN
    out TICK_FLAGS, DATA_LOW
    ldd DATA_LOW, Z+TICK_TOP+1
    sts OCR1AH, DATA_LOW
    ldd DATA_LOW, Z+TICK_TOP
    sts OCR1AL, DATA_LOW
    ldd SLOT_MARK, Z+TICK_END
    ldd DATA_LOW, Z+TICK_LAST_TOP
    sts emission_last_top, DATA_LOW
    ldd DATA_LOW, Z+TICK_LAST_TOP+1
    sts emission_last_top+1, DATA_LOW
    movw r30, SAVED_LOW
    reti
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
take_next_tick:
    sbi TICK_FLAGS, TICK_IS_NEXT
    sbi TICK_FLAGS, TICK_CHANGES
    lds DATA_LOW, emission_last_top+1
    sts OCR1AH, DATA_LOW
    lds DATA_LOW, emission_last_top
    sts OCR1AL, DATA_LOW
    lds r30, emission_next
    ldi r31, hi8(emission_silent)
    sts emission_taken, r30
    ld SLOT_LOW, Z
    ldd SLOT_HIGH, Z+TICK_MASK+1
    ldd SLOT_MARK, Z+TICK_MARK
    ldi r30, lo8(emission_silent)
    sts emission_next, r30
    movw r30, SAVED_LOW
    reti

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
    lds r30, emission_taken
    ldi r31, hi8(emission_silent)
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
    lds r30, emission_taken
    ldi r31, hi8(emission_silent)
    cpi r30, lo8(emission_silent)
    breq 1f
    ; A silent tick that follows holds its directions.
    ldd r24, Z+TICK_DIRECTION
    sts emission_silent+TICK_DIRECTION, r24
    .irp byte, 0, 1, 2, 3
    lds r24, emission_next_start+\byte
    sts emission_begun_at+\byte, r24
    .endr
    ldi r24, 1
    sts emission_committed, r24
1:
    clc
    .irp byte, 0, 1, 2, 3
    lds r24, emission_next_start+\byte
    ldd r25, Z+TICK_CYCLES+\byte
    adc r24, r25
    sts emission_next_start+\byte, r24
    .endr
    cbi TICK_FLAGS, TICK_CHANGES
    movw r30, SAVED_LOW
    pop r25
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    reti

    .text

    .global emission_set_registers
emission_set_registers:
    movw r30, r24
    ld SLOT_LOW, Z
    ldd SLOT_HIGH, Z+TICK_MASK+1
    ldd SLOT_MARK, Z+TICK_MARK
    clr ZERO
    in WANTED, _SFR_IO_ADDR(REST_LOW)
    ret
