; What is done for every motor in a tick; there are sixteen.

    .text

; void bushd_mcu_take_coarse_row(int16_t* queued, int16_t* steps, uint8_t motors, bushd_mcu_row* row). The low bytes of what is
; queued are 0.
    .global bushd_mcu_take_coarse_row
bushd_mcu_take_coarse_row:
    movw r26, r24
    movw r30, r22
    ldi r20, 16
1:
    adiw r26, 1
    ld r21, X
    st X+, r1
    st Z+, r21
    cp r1, r21
    ror r25
    ror r24
    lsl r21
    sbc r21, r21
    st Z+, r21
    ror r23
    ror r22
    dec r20
    brne 1b
    movw r30, r18
    st Z, r24
    std Z+1, r25
    std Z+2, r22
    std Z+3, r23
    ret

; void bushd_mcu_put_coarse_row(int16_t* queued, uint16_t mask, const uint8_t* counts)
    .global bushd_mcu_put_coarse_row
bushd_mcu_put_coarse_row:
    movw r30, r24
    movw r26, r20
    ldi r19, 16
1:
    lsr r23
    ror r22
    brcc 2f
    ld r18, X+
    ; Without bit 7 it goes backwards.
    mov r24, r18
    andi r18, 0x7F
    sbrs r24, 7
    neg r18
    st Z, r1
    std Z+1, r18
2:
    adiw r30, 2
    dec r19
    brne 1b
    ret

; void bushd_mcu_add_steps(int32_t* counter, size_t stride, const int16_t* steps, uint8_t motors). A motor makes fewer than 256
; steps in a tick.
    .global bushd_mcu_add_steps
bushd_mcu_add_steps:
    movw r30, r24
    movw r26, r20
1:
    ld r20, X+
    ld r21, X+
    ld r24, Z
    ldd r25, Z+1
    add r24, r20
    adc r25, r21
    st Z, r24
    std Z+1, r25
    ; The carry, and what the sign adds beyond: mostly they make up for each other.
    sbc r19, r19
    cpse r19, r21
    rjmp 3f
2:
    add r30, r22
    adc r31, r23
    dec r18
    brne 1b
    ret
3:
    ldd r24, Z+2
    ldd r25, Z+3
    ; Up with a carry, down without one.
    sub r24, r19
    sbc r25, r19
    add r24, r21
    adc r25, r21
    std Z+2, r24
    std Z+3, r25
    rjmp 2b
