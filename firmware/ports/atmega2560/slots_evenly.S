; void bushd_slots_fill_evenly(uint16_t* masks, uint16_t slot_count, const int16_t* steps, uint8_t motors) for 128 slots and
; 16 motors, in the same time however many steps there are. Step i of c falls into slot
;
;     floor(T),   T = (256 i + 128) / 2c
;
; A phase of 8 bits that begins at 127 and grows by 2c a slot carries there. Only the first half of the slots is made so:
; - even c: T of step i + c / 2 is T + 64, the second half is the first one again
; - odd c:  T of step c - 1 - i is 128 - T, the second half is the first one from its end to its beginning. T is
;   nowhere whole but in the middle, at 64: this step is one of the second half

#define SLOTS 128
; Bytes of half of the masks.
#define HALF_BYTES SLOTS

    ; The carry is shifted into the slot's mask.
    .macro phase now, step
    add r\now, r\step
    ror r28
    .endm

    ; Exchanges the bits of motors with odd steps.
    .macro swap_odd first, second, odd
    mov r26, r\first
    eor r26, r\second
    and r26, r\odd
    eor r\first, r26
    eor r\second, r26
    .endm

    .text

    .global bushd_slots_fill_evenly
bushd_slots_fill_evenly:
    .irp register, 10, 11, 12, 13, 14, 15, 16, 17, 28, 29
    push r\register
    .endr
    movw r26, r20
    movw r30, r24
    push r30
    push r31
    rcall fill_half
    push r24
    subi r30, lo8(HALF_BYTES - 1)
    sbci r31, hi8(HALF_BYTES - 1)
    rcall fill_half
    mov r25, r24
    pop r24
    pop r29
    pop r28
    movw r30, r28
    subi r30, lo8(-(HALF_BYTES - 8))
    sbci r31, hi8(-(HALF_BYTES - 8))
    ; Four slots from the half's beginning and four from its end at a time; r24 and r25: motors with odd steps.
    ldi r27, SLOTS / 16
1:
    ldd r10, Y+0
    ldd r11, Y+1
    ldd r12, Y+2
    ldd r13, Y+3
    ldd r14, Y+4
    ldd r15, Y+5
    ldd r16, Y+6
    ldd r17, Y+7
    ldd r18, Z+0
    ldd r19, Z+1
    ldd r20, Z+2
    ldd r21, Z+3
    ldd r22, Z+4
    ldd r23, Z+5
    ldd r0, Z+6
    ldd r1, Z+7
    swap_odd 10, 0, 24
    swap_odd 11, 1, 25
    swap_odd 12, 22, 24
    swap_odd 13, 23, 25
    swap_odd 14, 20, 24
    swap_odd 15, 21, 25
    swap_odd 16, 18, 24
    swap_odd 17, 19, 25
    subi r28, lo8(-HALF_BYTES)
    sbci r29, hi8(-HALF_BYTES)
    subi r30, lo8(-HALF_BYTES)
    sbci r31, hi8(-HALF_BYTES)
    std Y+0, r10
    std Y+1, r11
    std Y+2, r12
    std Y+3, r13
    std Y+4, r14
    std Y+5, r15
    std Y+6, r16
    std Y+7, r17
    std Z+0, r18
    std Z+1, r19
    std Z+2, r20
    std Z+3, r21
    std Z+4, r22
    std Z+5, r23
    std Z+6, r0
    std Z+7, r1
    subi r28, lo8(HALF_BYTES - 8)
    sbci r29, hi8(HALF_BYTES - 8)
    subi r30, lo8(HALF_BYTES + 8)
    sbci r31, hi8(HALF_BYTES + 8)
    dec r27
    breq 2f
    rjmp 1b
2:
    clr r1
    ; Y is in the middle of the half by now.
    subi r28, lo8(-(HALF_BYTES / 2))
    sbci r29, hi8(-(HALF_BYTES / 2))
    ld r26, Y
    or r26, r24
    st Y, r26
    ldd r26, Y+1
    or r26, r25
    std Y+1, r26
    .irp register, 29, 28, 17, 16, 15, 14, 13, 12, 11, 10
    pop r\register
    .endr
    ret

; Eight motors in the first half: masks from Z on, two bytes apart, steps from X on, which goes on behind them. r24: those with
; odd steps. Motor 0 is in bit 0.
fill_half:
    .irp register, 16, 17, 18, 19, 20, 21, 22, 23
    ld r\register, X+
    ld r29, X+
    sbrc r29, 7
    neg r\register
    mov r29, r\register
    lsr r29
    ror r24
    lsl r\register
    .endr
    ldi r28, 127
    .irp register, 0, 1, 10, 11, 12, 13, 14, 15
    mov r\register, r28
    .endr
    ldi r29, SLOTS / 16
1:
    .irp offset, 0, 2, 4, 6, 8, 10, 12, 14
    phase 0, 16
    phase 1, 17
    phase 10, 18
    phase 11, 19
    phase 12, 20
    phase 13, 21
    phase 14, 22
    phase 15, 23
    std Z+\offset, r28
    .endr
    adiw r30, 16
    dec r29
    breq 2f
    rjmp 1b
2:
    ret
