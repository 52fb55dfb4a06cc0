; What is done for every byte that comes, and for every byte that is sent.

#include "firmware/ports/atmega2560/line_interrupts.h"

    .text

; uint32_t bushd_crc32(uint32_t crc, const uint8_t* data, size_t size), a byte at a time by the table of engine/crc.c.
    .global bushd_crc32
bushd_crc32:
    cp r18, r1
    cpc r19, r1
    breq 2f
    movw r26, r20
    ; One round more where the low byte of the size is not 0.
    cpse r18, r1
    inc r19
1:
    ld r30, X+
    eor r30, r22
    clr r31
    lsl r30
    rol r31
    lsl r30
    rol r31
    subi r30, lo8(-(bushd_crc32_table))
    sbci r31, hi8(-(bushd_crc32_table))
    lpm r0, Z+
    mov r22, r23
    eor r22, r0
    lpm r0, Z+
    mov r23, r24
    eor r23, r0
    lpm r0, Z+
    mov r24, r25
    eor r24, r0
    lpm r25, Z
    dec r18
    brne 1b
    dec r19
    brne 1b
2:
    ret

; uint8_t line_decode(uint8_t** to, uint8_t* run, uint8_t out, uint8_t count): decodes up to `count` bytes of the ring from
; `out` on, as bushd_receiver_collect does, to *to and beyond; stops at a delimiter. Returns the next `out`.
    .global line_decode
line_decode:
    push r28
    push r29
    movw r28, r24
    ld r26, Y
    ldd r27, Y+1
    movw r24, r22
    movw r30, r24
    ld r23, Z
    mov r30, r20
    ldi r31, hi8(line_bytes)
3:
    ld r19, Z
    tst r19
    breq 5f
    tst r23
    brne 4f
    mov r23, r19
    clr r19
4:
    dec r23
    st X+, r19
    inc r30
    dec r18
    brne 3b
5:
    st Y, r26
    std Y+1, r27
    mov r18, r30
    movw r30, r24
    st Z, r23
    mov r24, r18
    pop r29
    pop r28
    ret
