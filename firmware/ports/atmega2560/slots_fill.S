; The inner loop of slots_fill.c. A motor's phase is changed by the same amount every slot, and where it
; overflows is its step; the carry is shifted into the slot's mask. Eight motors, motor 0 in bit 0; masks lie
; two bytes apart. r28 is the mask.

#include "firmware/ports/atmega2560/saved_registers.inc"

#define SLOTS 128

    .macro fine low, high, step_low, step_high
    sub r\low, r\step_low
    sbc r\high, r\step_high
    ror r28
    .endm

    .macro fine_four
    fine 0, 1, 16, 17
    fine 10, 11, 18, 19
    fine 12, 13, 20, 21
    fine 14, 15, 22, 23
    .endm

    .text

; void slots_fill_fine(uint8_t* masks, const slots_phase motor[8])
    .global slots_fill_fine
slots_fill_fine:
    save
    movw r26, r22
    push r24
    push r25
    movw r30, r24
    rcall load_four_motors
    ldi r29, SLOTS / 4
1:
    .irp offset, 0, 2, 4, 6
    fine_four
    std Z+\offset, r28
    .endr
    adiw r30, 8
    dec r29
    breq 2f
    rjmp 1b
2:
    pop r31
    pop r30
    rcall load_four_motors
    ldi r29, SLOTS / 4
3:
    .irp offset, 0, 2, 4, 6
    ldd r28, Z+\offset
    fine_four
    std Z+\offset, r28
    .endr
    adiw r30, 8
    dec r29
    breq 4f
    rjmp 3b
4:
    restore
    ret

; From X on: phase and step of each.
load_four_motors:
    .irp register, 0, 1, 16, 17, 10, 11, 18, 19, 12, 13, 20, 21, 14, 15, 22, 23
    ld r\register, X+
    .endr
    ret
