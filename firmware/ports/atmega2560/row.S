; void bushd_mcu_take_coarse_row(int16_t* queued, int16_t* steps, uint8_t motors, bushd_mcu_row* row), of sixteen motors. The
; low bytes of what is queued are 0.

    .text

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
