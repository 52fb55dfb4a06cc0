; The slot interrupts. Compare A begins a slot and its pulses, compare B ends them; neither changes a flag of
; SREG. What they work by is in emission_slots.h; GPIOR0 says what B has to do besides:
; 0: nothing, EMISSION_CHANGE in the last slot of a tick,
; EMISSION_BEGUN in the first.

#include <avr/io.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/emission_slots.h"

#define TICK_EVENT _SFR_IO_ADDR(GPIOR0)
#define KEPT_1 _SFR_IO_ADDR(GPIOR1)
#define KEPT_2 _SFR_IO_ADDR(GPIOR2)

    ; The next byte of the tick that comes.
    .macro copy offset
    ld r24, Z+
    sts emission_present+\offset, r24
    .endm

    .text

    .global TIMER1_COMPA_vect
TIMER1_COMPA_vect:
    out KEPT_1, r24
    out KEPT_2, r25
    push r30
    push r31
    lds r30, emission_present+TICK_MASK
    lds r31, emission_present+TICK_MASK+1
    ld r24, Z+
    ld r25, Z+
    out _SFR_IO_ADDR(STEP_LOW), r24
    out _SFR_IO_ADDR(STEP_HIGH), r25
    sts emission_present+TICK_MASK, r30
    sts emission_present+TICK_MASK+1, r31
    ; 2 bytes a slot, 128 slots: the low byte tells where the tick ends.
    lds r24, emission_present+TICK_END
    cpse r30, r24
    rjmp 1f
    lds r24, emission_present+TICK_LAST_TOP+1
    sts OCR1AH, r24
    lds r24, emission_present+TICK_LAST_TOP
    sts OCR1AL, r24
    ldi r24, EMISSION_CHANGE
    out TICK_EVENT, r24
1:
    pop r31
    pop r30
    in r25, KEPT_2
    in r24, KEPT_1
    reti

    .global TIMER1_COMPB_vect
TIMER1_COMPB_vect:
    out KEPT_1, r24
    ldi r24, 0
    out _SFR_IO_ADDR(STEP_LOW), r24
    out _SFR_IO_ADDR(STEP_HIGH), r24
    in r24, TICK_EVENT
    sbrc r24, 7
    rjmp 2f
    in r24, KEPT_1
    reti
2:
    sbrc r24, 1
    rjmp 3f
    ; Pulses are over: DIR may change.
    push r30
    push r31
    lds r30, emission_next
    lds r31, emission_next+1
    sts emission_taken, r30
    sts emission_taken+1, r31
    ldi r24, lo8(emission_silent)
    sts emission_next, r24
    ldi r24, hi8(emission_silent)
    sts emission_next+1, r24
    ld r24, Z+
    sts _SFR_MEM_ADDR(DIR_LOW), r24
    ld r24, Z+
    out _SFR_IO_ADDR(DIR_HIGH), r24
    copy TICK_MASK
    copy TICK_MASK+1
    copy TICK_END
    copy TICK_TOP
    copy TICK_TOP+1
    copy TICK_LAST_TOP
    copy TICK_LAST_TOP+1
    ldi r24, EMISSION_BEGUN
    out TICK_EVENT, r24
    pop r31
    pop r30
    in r24, KEPT_1
    reti
3:
    lds r24, emission_present+TICK_TOP+1
    sts OCR1AH, r24
    lds r24, emission_present+TICK_TOP
    sts OCR1AL, r24
    ldi r24, 0
    out TICK_EVENT, r24
    in r24, KEPT_1
    ; Slots go on meanwhile.
    jmp __vector_emission_begun
