; A motor's steps on a line, for 128 slots: what lib/engine/line_follower.c does under the same name. Some 80 to 100 cycles a step,
; and 30 for a motor that makes none.

#include "firmware/ports/atmega2560/run_parts.h"
#include "firmware/ports/atmega2560/saved_registers.inc"

; r18 is the step of the run, counted from the first of these, in which the motor's next one falls, at the end of its part r23. Of
; the follower's fields r10 .. r13 have `lead`. r16 and r17 point to the spans, r19 is what r18 was at the beginning, r22 the motor's
; bit in the byte of the mask that has it, r24 counts, r25 is the last span. X points to that byte of the first slot's mask, Y to
; the follower. T: its steps are so far apart that the next one is not among these.

#define LAST_SLOT 127

    ; The lead and one of the follower's fields; a borrow, or a carry, remains.
    .macro to_lead first, rest, field
    ldd r0, Y+\field
    \first r10, r0
    ldd r0, Y+\field+1
    \rest r11, r0
    ldd r0, Y+\field+2
    \rest r12, r0
    ldd r0, Y+\field+3
    \rest r13, r0
    .endm

    ; With a borrow the step is one part earlier.
    .macro next_lead
    to_lead sub, sbc, FOLLOWER_APART_LATE
    .endm

    .macro add_increment
    to_lead add, adc, FOLLOWER_INCREMENT
    .endm

    .text

; uint8_t bushd_line_follower_make(bushd_line_follower* follower, const bushd_run_spans* spans, uint16_t bit)
    .global bushd_line_follower_make
bushd_line_follower_make:
    movw r30, r24
    movw r26, r22
    ldd r18, Z+FOLLOWER_DUE_STEP
    ldd r19, Z+FOLLOWER_DUE_STEP+1
    ldd r24, Z+FOLLOWER_DUE_STEP+2
    ldd r25, Z+FOLLOWER_DUE_STEP+3
    ld r0, X+
    sub r18, r0
    ld r0, X+
    sbc r19, r0
    ld r0, X+
    sbc r24, r0
    ld r0, X
    sbc r25, r0
    or r19, r24
    or r19, r25
    brne none
    adiw r26, SPANS_COUNT-3
    ld r25, X+
    cp r18, r25
    brlo some
none:
    clr r24
    ret

some:
    save
    movw r28, r30
    movw r16, r26
    movw r30, r22
    ldd r26, Z+SPANS_MASKS
    ldd r27, Z+SPANS_MASKS+1
    mov r22, r20
    tst r22
    brne 1f
    mov r22, r21
    adiw r26, 1
1:
    dec r25
    mov r19, r18
    ldd r23, Y+FOLLOWER_DUE_PART
    ldd r10, Y+FOLLOWER_LEAD
    ldd r11, Y+FOLLOWER_LEAD+1
    ldd r12, Y+FOLLOWER_LEAD+2
    ldd r13, Y+FOLLOWER_LEAD+3
    ldd r20, Y+FOLLOWER_APART_STEPS+1
    ldd r0, Y+FOLLOWER_APART_STEPS+2
    or r20, r0
    ldd r0, Y+FOLLOWER_APART_STEPS+3
    or r20, r0
    ldd r21, Y+FOLLOWER_APART_STEPS
    andi r21, 0x80
    or r20, r21
    clt
    breq .+2
    set
    clr r24
    cp r18, r25
    brne make
    rjmp in_last
make:
    ldi r31, SPAN_SIZE
    mul r18, r31
    movw r30, r16
    add r30, r0
    adc r31, r1
    ; The place, of which the highest byte is the slot: first + part x r23.
    ldd r20, Z+SPAN_PART
    mul r20, r23
    movw r14, r0
    ldd r20, Z+SPAN_PART+2
    mul r20, r23
    movw r20, r0
    ldd r0, Z+SPAN_PART+1
    mul r0, r23
    add r15, r0
    adc r20, r1
    brcc .+2
    inc r21
    ldd r0, Z+SPAN_PART+3
    mul r0, r23
    add r21, r0
    ld r0, Z
    add r14, r0
    ldd r0, Z+SPAN_FIRST+1
    adc r15, r0
    ldd r0, Z+SPAN_FIRST+2
    adc r20, r0
    ldd r0, Z+SPAN_FIRST+3
    adc r21, r0
    sbrc r21, 7
    ldi r21, LAST_SLOT
    lsl r21
    mov r30, r21
    ldi r31, 0
    add r30, r26
    adc r31, r27
    ld r0, Z
    or r0, r22
    st Z, r0
    inc r24
    ldd r0, Y+FOLLOWER_APART_PARTS
    add r23, r0
    brts far
    ; The next one may be in these steps too.
    ldd r0, Y+FOLLOWER_APART_STEPS
    adc r18, r0
    next_lead
    brcc 2f
    add_increment
    subi r23, 1
    sbci r18, 0
2:
    cp r18, r25
    breq in_last
    brsh near_done
    rjmp make
in_last:
    movw r30, r16
    sbiw r30, SPANS_SPAN-SPANS_PARTS
    ld r0, Z
    ldd r21, Z+1
    ldi r31, 0
    cp r23, r0
    cpc r31, r21
    brsh near_done
    rjmp make
near_done:
    clr r14
    clr r15
    clr r20
    rjmp done
    ; Its step may need r18, r14, r15 and r20.
far:
    ldi r31, 0
    ldd r0, Y+FOLLOWER_APART_STEPS
    adc r18, r0
    ldd r14, Y+FOLLOWER_APART_STEPS+1
    adc r14, r31
    ldd r15, Y+FOLLOWER_APART_STEPS+2
    adc r15, r31
    ldd r20, Y+FOLLOWER_APART_STEPS+3
    adc r20, r31
    next_lead
    brcc done
    add_increment
    subi r23, 1
    sbci r18, 0
    sbc r14, r31
    sbc r15, r31
    sbc r20, r31
done:
    tst r24
    breq 3f
    ldi r31, 0
    sub r18, r19
    sbc r14, r31
    sbc r15, r31
    sbc r20, r31
    ldd r0, Y+FOLLOWER_DUE_STEP
    add r0, r18
    std Y+FOLLOWER_DUE_STEP, r0
    ldd r0, Y+FOLLOWER_DUE_STEP+1
    adc r0, r14
    std Y+FOLLOWER_DUE_STEP+1, r0
    ldd r0, Y+FOLLOWER_DUE_STEP+2
    adc r0, r15
    std Y+FOLLOWER_DUE_STEP+2, r0
    ldd r0, Y+FOLLOWER_DUE_STEP+3
    adc r0, r20
    std Y+FOLLOWER_DUE_STEP+3, r0
    std Y+FOLLOWER_LEAD, r10
    std Y+FOLLOWER_LEAD+1, r11
    std Y+FOLLOWER_LEAD+2, r12
    std Y+FOLLOWER_LEAD+3, r13
    std Y+FOLLOWER_DUE_PART, r23
3:
    restore
    ret
