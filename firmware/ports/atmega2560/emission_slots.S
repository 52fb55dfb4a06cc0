; The slot interrupts. Compare A begins a slot and its pulses, compare B ends them, compare C comes after it in
; the last slot of a tick and in the first one of the next. None of them changes a flag of SREG. In section
; .vectors they lie behind the vectors, so that these reach them by rjmp.
;
; Cycles with entry and vector: A 23, B 16 (22 where a STEP rests high, 24 with a common DIR), and once a tick: A in the first slot 51 and in the last one 59,
; C 26 and then 16 with interrupts off.

#include <avr/io.h>

#include <board.h>
#include "firmware/ports/atmega2560/emission_slots.h"

#define TICK_FLAGS _SFR_IO_ADDR(GPIOR0)

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
take_next_tick:
    sbi TICK_FLAGS, TICK_IS_NEXT
    sbi TICK_FLAGS, TICK_CHANGES
    lds DATA_LOW, emission_last_top+1
    sts OCR1AH, DATA_LOW
    lds DATA_LOW, emission_last_top
    sts OCR1AL, DATA_LOW
    ldi r30, 1 << OCF1C
    out _SFR_IO_ADDR(TIFR1), r30
    ldi r30, 1 << OCIE1A | 1 << OCIE1B | 1 << OCIE1C
    sts TIMSK1, r30
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
    lds r30, emission_taken
    ldi r31, hi8(emission_silent)
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
    lds r30, emission_taken
    ldi r31, hi8(emission_silent)
    cpi r30, lo8(emission_silent)
    breq 1f
    ; A silent tick that follows holds its directions.
    ldd r24, Z+TICK_DIRECTION
    sts emission_silent+TICK_DIRECTION, r24
    ldd r24, Z+TICK_DIRECTION+1
    sts emission_silent+TICK_DIRECTION+1, r24
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
    movw r30, r24
    ld SLOT_LOW, Z
    ldd SLOT_HIGH, Z+TICK_MASK+1
    ldd SLOT_MARK, Z+TICK_MARK
    clr ZERO
    ret
