// Stands for avr-libc's: registers of the ATmega2560 as variables, so that C files of the port run
// on the host (port.c). Only what those files name.
#ifndef BUSHD_FUZZ_ATMEGA2560_AVR_IO_H
#define BUSHD_FUZZ_ATMEGA2560_AVR_IO_H

#include <stdint.h>

#define __flash
#define E2END 0xFFFu

extern volatile uint8_t PORTA, PORTB, PORTC, PORTD, PORTE, PORTF, PORTH, PORTJ, PORTK, PORTL;
extern volatile uint8_t DDRA, DDRB, DDRC, DDRE, DDRF, DDRG, DDRH, DDRL;
extern volatile uint8_t GPIOR1, GPIOR2, OCR0A, OCR0B, OCR2A, OCR2B;
extern volatile uint8_t GTCCR, TCCR3B, TCCR4B, TCCR5B, TIMSK3, TIFR3;
extern volatile uint16_t TCNT3, OCR3A;
extern volatile uint8_t UCSR0A, UCSR0B, UCSR0C, UBRR0H, UBRR0L;

#define CS30 0
#define CS40 0
#define CS41 1
#define CS51 1
#define PSRSYNC 0
#define TSM 7
#define OCIE3A 1
#define OCF3A 1
#define U2X0 1
#define UCSZ00 1
#define UCSZ01 2
#define TXEN0 3
#define RXEN0 4
#define UDRIE0 5
#define RXCIE0 7

#endif
