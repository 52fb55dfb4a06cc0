; The UART's interrupts. Slots must not wait for them: they let other interrupts in as soon as the UART has
; what it needs, and their places in the rings are theirs.

#include <avr/io.h>

#include "firmware/ports/atmega2560/line_interrupts.h"

#define FLAGS _SFR_IO_ADDR(SREG)

    .text

    .global USART0_RX_vect
USART0_RX_vect:
    push r24
    in r24, FLAGS
    push r24
    push r25
    push r30
    lds r25, UDR0
    lds r24, line_in
    inc r24
    lds r30, line_out
    cp r24, r30
    breq 3f
    sts line_in, r24
    tst r25
    breq 4f
    sei
1:
    push r31
    mov r30, r24
    dec r30
    ldi r31, 0
    subi r30, lo8(-(line_bytes))
    sbci r31, hi8(-(line_bytes))
    st Z, r25
    pop r31
3:
    pop r30
    pop r25
    pop r24
    out FLAGS, r24
    pop r24
    reti
4:
    push r31
    lds r30, TCNT5L
    lds r31, TCNT5H
    lds r25, clock_overflows
    andi r25, 0x7F
    sbic _SFR_IO_ADDR(TIFR5), TOV5
    ori r25, 0x80
    sei
    push r26
    push r27
    cli
    lds r26, line_stamps_in
    lds r27, line_stamps_out
    sub r27, r26
    cpi r27, -LINE_DELIMITERS
    breq 5f
    inc r26
    sts line_stamps_in, r26
    sei
    dec r26
    andi r26, LINE_DELIMITERS - 1
    mov r27, r26
    lsl r26
    add r26, r27
    ldi r27, 0
    subi r26, lo8(-(line_stamps))
    sbci r27, hi8(-(line_stamps))
    st X+, r30
    st X+, r31
    st X, r25
    ldi r25, 0
    rjmp 6f
5:
    sei
    ldi r25, 1
6:
    pop r27
    pop r26
    pop r31
    rjmp 1b

; TXC is cleared beside each byte, so that it can only tell of the last one's stop bit.
    .global USART0_UDRE_vect
USART0_UDRE_vect:
    push r24
    in r24, FLAGS
    push r24
    push r30
    push r31
    lds r30, line_sending
    lds r31, line_sending+1
    ldi r24, 1 << U2X0 | 1 << TXC0
    sts UCSR0A, r24
    ld r24, Z+
    sts UDR0, r24
    sts line_sending, r30
    sts line_sending+1, r31
    lds r24, line_sending_end
    cpse r30, r24
    rjmp 1f
    ldi r24, 1 << TXEN0 | 1 << TXCIE0
    sts UCSR0B, r24
1:
    pop r31
    pop r30
    pop r24
    out FLAGS, r24
    pop r24
    reti
