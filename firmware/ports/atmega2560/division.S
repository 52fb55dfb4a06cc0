; 64-bit division in place of libgcc's, which uses registers that interrupts have to themselves
; (emission_slots.h). Numerator in r25:r18, divisor in r17:r10, result in r25:r18, as C has them.

    .text

    ; `first` on the lowest bytes, `others` on those above.
    .macro rest_and_divisor first, others
    \first r26, r10
    \others r27, r11
    \others r28, r12
    \others r29, r13
    \others r30, r14
    \others r31, r15
    \others r0, r16
    .endm

    .macro numerator_and_divisor first, others
    \first r18, r10
    \others r19, r11
    \others r20, r12
    \others r21, r13
    \others r22, r14
    \others r23, r15
    \others r24, r16
    \others r25, r17
    .endm

    .macro shift_left first, others
    \first r18
    .irp register, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 0
    \others r\register
    .endr
    .endm

    .global __udivdi3
__udivdi3:
    push r17
    push r28
    push r29
    rcall divide
    rjmp return

    .global __umoddi3
__umoddi3:
    push r17
    push r28
    push r29
    rcall divide
    movw r18, r26
    movw r20, r28
    movw r22, r30
    movw r24, r0
return:
    clr r1
    pop r29
    pop r28
    pop r17
    ret

; Quotient in r25:r18, rest in r1:r0 r31:r26.
divide:
    .irp register, 0, 1, 26, 27, 28, 29, 30, 31
    clr r\register
    .endr
    tst r17
    brne few_times
    ; The rest has seven bytes: bit by bit, but for the zero bytes in front.
    ldi r17, 64
1:
    tst r25
    brne 2f
    cpi r17, 8
    breq 2f
    mov r25, r24
    mov r24, r23
    mov r23, r22
    mov r22, r21
    mov r21, r20
    mov r20, r19
    mov r19, r18
    clr r18
    subi r17, 8
    rjmp 1b
2:
    shift_left lsl, rol
    brcs 3f
    rest_and_divisor cp, cpc
    brcs 4f
3:
    rest_and_divisor sub, sbc
    inc r18
4:
    dec r17
    brne 2b
    ret
    ; A divisor of eight bytes: the quotient has one.
few_times:
    numerator_and_divisor cp, cpc
    brcs 5f
    numerator_and_divisor sub, sbc
    inc r26
    rjmp few_times
5:
    movw r0, r24
    movw r30, r22
    movw r28, r20
    mov r27, r19
    mov r24, r26
    mov r26, r18
    mov r18, r24
    .irp register, 19, 20, 21, 22, 23, 24, 25
    clr r\register
    .endr
    ret
