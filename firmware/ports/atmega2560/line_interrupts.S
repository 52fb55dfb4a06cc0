; The UART's interrupts, by the registers that interrupts have to themselves (emission_slots.h). A slot that comes
; as one of them begins waits until it is over, and then for one instruction of the main loop, of up to 5 cycles. So
; that this is no more than 35, RX has interrupts off for 26 cycles with entry and vector, UDRE for 27, with the last
; byte for 30.

#include <avr/io.h>

#include <board.h>
#include <board.inc>
#include "firmware/ports/atmega2560/emission_slots.h"
#include "firmware/ports/atmega2560/line_interrupts.h"

    .section .vectors, "ax", @progbits

    .global USART0_RX_vect
USART0_RX_vect:
    movw SAVED_LOW, r30
    in r30, _SFR_IO_ADDR(LINE_IN)
    ldi r31, hi8(line_bytes)
    lds DATA_LOW, UDR0
    st Z+, DATA_LOW
    in r31, _SFR_IO_ADDR(LINE_OUT)
    cpse r30, r31
    rjmp has_room
    ; The ring is full: the byte is lost.
    movw r30, SAVED_LOW
    reti
has_room:
    out _SFR_IO_ADDR(LINE_IN), r30
    movw r30, SAVED_LOW
    cpse DATA_LOW, ZERO
    reti
    ; No slot is to wait for the rest; the time is a slot's interrupts later at worst.
    sei
    push r30
    push r31
    push r24
    in r24, _SFR_IO_ADDR(SREG)
    push r24
1:
    ; The trigger's interrupt reads the timer through the same register for its high byte, which counts then if the low
    ; one has begun anew.
    lds r30, CLOCK_COUNT_LOW
    lds r31, CLOCK_COUNT_HIGH
    lds r24, CLOCK_COUNT_LOW
    cp r24, r30
    brlo 1b
    push r26
    push r27
    cli
    lds r26, line_stamps_in
    inc r26
    sts line_stamps_in, r26
    sei
    dec r26
    andi r26, LINE_DELIMITERS - 1
    lsl r26
    ldi r27, 0
    subi r26, lo8(-(line_stamps))
    sbci r27, hi8(-(line_stamps))
    st X+, r30
    st X, r31
    pop r27
    pop r26
    pop r24
    out _SFR_IO_ADDR(SREG), r24
    pop r24
    pop r31
    pop r30
    reti

    .global USART0_UDRE_vect
USART0_UDRE_vect:
    movw SAVED_LOW, r30
    load_sending
    ld DATA_LOW, Z+
    sts UDR0, DATA_LOW
    lds DATA_LOW, line_sending_end
    cpse r30, DATA_LOW
    rjmp more_to_send
    ; TXC is to tell of this byte's stop bit.
    ldi r30, 1 << U2X0 | 1 << TXC0
    sts UCSR0A, r30
    ldi r30, 1 << TXEN0 | 1 << TXCIE0
    sts UCSR0B, r30
    movw r30, SAVED_LOW
    reti
more_to_send:
    store_sending
    movw r30, SAVED_LOW
    reti

    .global USART0_TX_vect
USART0_TX_vect:
    cbi _SFR_IO_ADDR(DE_PORT), DE_BIT
    push r24
    ldi r24, 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0
    sts UCSR0B, r24
    pop r24
    reti
