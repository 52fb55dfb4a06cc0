; Steps of table runs into 128 slots: what lib/engine/run_slots.c does under the same names, its places modulo 2^40. Some 70
; cycles a step on a ramp and 35 in cruise.

#include "firmware/ports/atmega2560/run_parts.h"
#include "firmware/ports/atmega2560/saved_registers.inc"

; A place in r10 .. r14: r14 is the slot. A rate in r15 .. r19, a delay in r20 and r21. r22 is the motor's bit in the
; byte of the mask that has it, r23 counts what is left, r24 and r25 are `since`. Y points to that byte of the first slot's mask.

#define LAST_SLOT 127

    ; place += delay x rate. Carries that leave r14 are lost.
    .macro move_place
    mul r20, r19
    add r14, r0
    mul r20, r17
    movw r30, r0
    mul r20, r15
    add r10, r0
    adc r11, r1
    adc r12, r30
    adc r13, r31
    brcc .+2
    inc r14
    mul r20, r18
    movw r30, r0
    mul r20, r16
    add r11, r0
    adc r12, r1
    adc r13, r30
    adc r14, r31
    mul r21, r17
    movw r30, r0
    mul r21, r15
    add r11, r0
    adc r12, r1
    adc r13, r30
    adc r14, r31
    mul r21, r18
    add r14, r0
    mul r21, r16
    add r12, r0
    adc r13, r1
    brcc .+2
    inc r14
    .endm

    ; A step exactly at the tick's end has the place behind the last slot.
    .macro make_due
    mov r30, r14
    sbrc r30, 7
    ldi r30, LAST_SLOT
    lsl r30
    ldi r31, 0
    add r30, r28
    adc r31, r29
    ld r0, Z
    or r0, r22
    st Z, r0
    sub r24, r20
    sbc r25, r21
    dec r23
    .endm

    .text

; void bushd_run_move_place(uint64_t* place, const uint64_t* rate, uint16_t times)
    .global bushd_run_move_place
bushd_run_move_place:
    .irp register, 10, 11, 12, 13, 14, 15, 16, 17
    push r\register
    .endr
    movw r26, r24
    movw r30, r22
    ld r15, Z
    ldd r16, Z+1
    ldd r17, Z+2
    ldd r18, Z+3
    ldd r19, Z+4
    movw r30, r26
    ld r10, Z
    ldd r11, Z+1
    ldd r12, Z+2
    ldd r13, Z+3
    ldd r14, Z+4
    move_place
    st X+, r10
    st X+, r11
    st X+, r12
    st X+, r13
    st X, r14
    .irp register, 17, 16, 15, 14, 13, 12, 11, 10
    pop r\register
    .endr
    clr r1
    ret

; void bushd_run_take_span(bushd_run_span* span, uint64_t* place, const uint64_t* rate, uint16_t times). What it lasts is in r20,
; r21, r24, r25, r26 and r17, modulo 2^48.
    .macro add_to_span low, middle, high
    ld r27, Z+
    mul r27, r18
    add r\low, r0
    adc r\middle, r1
    clr r\high
    adc r\high, r\high
    mul r27, r19
    add r\middle, r0
    adc r\high, r1
    .endm

    .global bushd_run_take_span
bushd_run_take_span:
    push r17
    push r25
    push r24
    movw r30, r20
    clr r20
    clr r21
    add_to_span 20, 21, 24
    add_to_span 21, 24, 25
    add_to_span 24, 25, 26
    add_to_span 25, 26, 17
    ld r27, Z+
    mul r27, r18
    add r26, r0
    adc r17, r1
    mul r27, r19
    add r17, r0
    ld r27, Z
    mul r27, r18
    add r17, r0
    clr r1
    movw r30, r22
    ld r18, Z
    ldd r19, Z+1
    ldd r22, Z+2
    ldd r23, Z+3
    ldd r27, Z+4
    mov r0, r18
    add r0, r20
    st Z, r0
    mov r0, r19
    adc r0, r21
    std Z+1, r0
    mov r0, r22
    adc r0, r24
    std Z+2, r0
    mov r0, r23
    adc r0, r25
    std Z+3, r0
    mov r0, r27
    adc r0, r26
    std Z+4, r0
    pop r30
    pop r31
    ; A part, rounded up, and the place, rounded up.
    subi r24, 0xFF
    sbci r25, 0xFF
    sbci r26, 0xFF
    sbci r17, 0xFF
    cp r1, r18
    adc r19, r24
    adc r22, r25
    adc r23, r26
    adc r27, r17
    st Z, r19
    std Z+SPAN_FIRST+1, r22
    std Z+SPAN_FIRST+2, r23
    std Z+SPAN_FIRST+3, r27
    std Z+SPAN_PART, r24
    std Z+SPAN_PART+1, r25
    std Z+SPAN_PART+2, r26
    std Z+SPAN_PART+3, r17
    pop r17
    ret

; uint8_t bushd_run_share(uint16_t numerator, uint8_t low, uint16_t divisor)
    .global bushd_run_share
bushd_run_share:
    ; The bit leaves it after eight rounds.
    ldi r18, 1
1:
    lsl r22
    rol r24
    rol r25
    brcs 2f
    cp r24, r20
    cpc r25, r21
    brcs 3f
2:
    sub r24, r20
    sbc r25, r21
    sec
    rjmp 4f
3:
    clc
4:
    rol r18
    brcc 1b
    mov r24, r18
    ret

; Loads the part in r24 and r25, which stays on the stack.
load_part:
    movw r30, r24
    ldd r10, Z+PART_PLACE
    ldd r11, Z+PART_PLACE+1
    ldd r12, Z+PART_PLACE+2
    ldd r13, Z+PART_PLACE+3
    ldd r14, Z+PART_PLACE+4
    ldd r26, Z+PART_RATE
    ldd r27, Z+PART_RATE+1
    ld r15, X+
    ld r16, X+
    ld r17, X+
    ld r18, X+
    ld r19, X
    ldd r26, Z+PART_CODE
    ldd r27, Z+PART_CODE+1
    ldd r28, Z+PART_MASKS
    ldd r29, Z+PART_MASKS+1
    ldd r22, Z+PART_BIT
    tst r22
    brne 1f
    ldd r22, Z+PART_BIT+1
    adiw r28, 1
1:
    ldd r20, Z+PART_DELAY
    ldd r21, Z+PART_DELAY+1
    ldd r23, Z+PART_LEFT
    ldd r24, Z+PART_SINCE
    ldd r25, Z+PART_SINCE+1
    ret

; void bushd_run_make_on_side(bushd_run_part* part, bool down)
    .global bushd_run_make_on_side
bushd_run_make_on_side:
    save
    push r24
    push r25
    bst r22, 0
    rcall load_part
    brtc 2f
    rjmp down
2:
    adiw r26, 2
up:
    make_due
    breq done
    ld r20, X+
    ld r21, X+
    cp r24, r20
    cpc r25, r21
    brlo done
    move_place
    rjmp up
done:
    pop r31
    pop r30
    std Z+PART_PLACE, r10
    std Z+PART_PLACE+1, r11
    std Z+PART_PLACE+2, r12
    std Z+PART_PLACE+3, r13
    std Z+PART_PLACE+4, r14
    std Z+PART_SINCE, r24
    std Z+PART_SINCE+1, r25
    std Z+PART_LEFT, r23
    restore
    ret
down:
    make_due
    breq done
    ld r21, -X
    ld r20, -X
    cp r24, r20
    cpc r25, r21
    brlo done
    move_place
    rjmp down

; void bushd_run_make_evenly(bushd_run_part* part)
    .global bushd_run_make_evenly
bushd_run_make_evenly:
    save
    push r24
    push r25
    rcall load_part
1:
    make_due
    breq 2f
    cp r24, r20
    cpc r25, r21
    brlo 2f
    add r10, r15
    adc r11, r16
    adc r12, r17
    adc r13, r18
    adc r14, r19
    rjmp 1b
2:
    rjmp done
