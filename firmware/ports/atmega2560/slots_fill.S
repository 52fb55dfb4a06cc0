; The inner loops of slots_fill.c. A motor's phase is changed by the same amount every slot, and where it
; overflows is its step; the carry is shifted into the slot's mask. Eight motors, motor 0 in bit 0; masks lie
; two bytes apart. r18 is the mask.

#define SLOTS 128

    .macro save
    .irp register, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17
    push r\register
    .endr
    .endm

    .macro restore
    .irp register, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2
    pop r\register
    .endr
    .endm

    .macro coarse phase, step
    add r\phase, r\step
    ror r18
    .endm

    .macro fine low, high, step_low, step_high
    sub r\low, r\step_low
    sbc r\high, r\step_high
    ror r18
    .endm

    .macro fine_four
    fine 2, 3, 10, 11
    fine 4, 5, 12, 13
    fine 6, 7, 14, 15
    fine 8, 9, 16, 17
    .endm

    .text

; void slots_fill_coarse(uint8_t* masks, const uint8_t step[8])
    .global slots_fill_coarse
slots_fill_coarse:
    save
    movw r26, r22
    .irp register, 10, 11, 12, 13, 14, 15, 16, 17
    ld r\register, X+
    .endr
    ldi r18, 127
    .irp register, 2, 3, 4, 5, 6, 7, 8, 9
    mov r\register, r18
    .endr
    movw r30, r24
    ldi r19, SLOTS / 4
1:
    .irp offset, 0, 2, 4, 6
    coarse 2, 10
    coarse 3, 11
    coarse 4, 12
    coarse 5, 13
    coarse 6, 14
    coarse 7, 15
    coarse 8, 16
    coarse 9, 17
    std Z+\offset, r18
    .endr
    adiw r30, 8
    dec r19
    breq 2f
    rjmp 1b
2:
    restore
    ret

; void slots_fill_fine(uint8_t* masks, const slots_phase motor[8])
    .global slots_fill_fine
slots_fill_fine:
    save
    movw r26, r22
    rcall load_four_motors
    movw r30, r24
    ldi r19, SLOTS / 4
1:
    .irp offset, 0, 2, 4, 6
    fine_four
    std Z+\offset, r18
    .endr
    adiw r30, 8
    dec r19
    breq 2f
    rjmp 1b
2:
    rcall load_four_motors
    movw r30, r24
    ldi r19, SLOTS / 4
3:
    .irp offset, 0, 2, 4, 6
    ldd r18, Z+\offset
    fine_four
    std Z+\offset, r18
    .endr
    adiw r30, 8
    dec r19
    breq 4f
    rjmp 3b
4:
    restore
    ret

; From X on: phase and step of each.
load_four_motors:
    .irp register, 2, 3, 10, 11, 4, 5, 12, 13, 6, 7, 14, 15, 8, 9, 16, 17
    ld r\register, X+
    .endr
    ret
