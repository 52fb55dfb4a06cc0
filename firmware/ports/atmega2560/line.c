#include "firmware/ports/atmega2560/line.h"

#include <avr/interrupt.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"

#define BIT_PERIODS (CYCLES_PER_US * 1000000UL / BUSHD_AVR_BAUD)
// With U2X, the only way to the high rates; rounded.
#define DIVISOR ((CYCLES_PER_US * 1000000UL + 4UL * BUSHD_AVR_BAUD) / (8UL * BUSHD_AVR_BAUD) - 1UL)
// One byte time belongs to the one who spoke last; a few cycles more for what is not exact.
#define TURNAROUND_CYCLES (10UL * BIT_PERIODS + 100UL)
// What timer 3 is set to at least and at most.
#define SHORTEST_CYCLES 16UL
#define LONGEST_CYCLES 60000UL

// Frames that may wait while a tick is prepared; beyond, a delimiter is dropped like a lost byte.
#define DELIMITERS 16u

// Indices of bytes wrap with their type.
static uint8_t bytes[256];
static volatile uint8_t bytes_in;
static uint8_t bytes_out;
static uint32_t delimiter_time[DELIMITERS];
static volatile uint8_t delimiters_in;
static volatile uint8_t delimiters_out;
static uint32_t last_delimiter;

static const uint8_t* sending;
static uint16_t sending_left;
static uint32_t sending_due;

ISR(USART0_RX_vect) {
  const uint8_t byte = UDR0;
  const uint8_t next = (uint8_t)(bytes_in + 1u);
  if (next == *(volatile uint8_t*)&bytes_out) return;
  if (byte == 0) {
    const uint8_t in = delimiters_in;
    if ((uint8_t)(in - delimiters_out) == DELIMITERS) return;
    delimiter_time[in % DELIMITERS] = clock_now_locked();
    delimiters_in = (uint8_t)(in + 1u);
  }
  bytes[bytes_in] = byte;
  bytes_in = next;
}

// Timer 3 waits until an answer is due, in several turns if need be.
static void wait_until_due(void) {
  const uint32_t now = clock_now_locked();
  uint32_t left = clock_before(now, sending_due) ? sending_due - now : 0;
  if (left < SHORTEST_CYCLES) left = SHORTEST_CYCLES;
  TCNT3 = 0;
  OCR3A = (uint16_t)(left < LONGEST_CYCLES ? left : LONGEST_CYCLES);
  TIFR3 = 1 << OCF3A;
  TIMSK3 = 1 << OCIE3A;
  TCCR3B = 1 << WGM32 | 1 << CS30;
}

ISR(TIMER3_COMPA_vect) {
  if (clock_before(clock_now_locked(), sending_due)) {
    wait_until_due();
    return;
  }
  TCCR3B = 0;
  TIMSK3 = 0;
  DE_PORT |= 1 << DE_BIT;
  UCSR0B = 1 << TXEN0 | 1 << UDRIE0;
}

// TXC is cleared beside each byte, so that it can only tell of the last one's stop bit.
ISR(USART0_UDRE_vect) {
  UCSR0A = 1 << U2X0 | 1 << TXC0;
  UDR0 = *sending++;
  if (--sending_left == 0) UCSR0B = 1 << TXEN0 | 1 << TXCIE0;
}

ISR(USART0_TX_vect) {
  DE_PORT &= (uint8_t) ~(1 << DE_BIT);
  UCSR0B = 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0;
}

void line_init(void) {
  UCSR0A = 1 << U2X0;
  UBRR0H = (uint8_t)(DIVISOR >> 8);
  UBRR0L = (uint8_t)DIVISOR;
  UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
  UCSR0B = 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0;
}

bool line_delimiter_time(uint32_t* time) {
  const uint8_t out = delimiters_out;
  if (out == delimiters_in) return false;
  *time = delimiter_time[out % DELIMITERS];
  return true;
}

bool line_take(uint8_t* byte, uint32_t* time) {
  if (bytes_out == bytes_in) return false;
  *byte = bytes[bytes_out];
  bytes_out = (uint8_t)(bytes_out + 1u);
  if (*byte == 0) {
    *time = last_delimiter = delimiter_time[delimiters_out % DELIMITERS];
    delimiters_out = (uint8_t)(delimiters_out + 1u);
  }
  return true;
}

void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns) {
  // Reply slots are whole multiples of 10 us.
  const uint32_t delay = delay_ns / 1000u * CYCLES_PER_US;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    sending = wire;
    sending_left = (uint16_t)size;
    sending_due = last_delimiter + (delay > TURNAROUND_CYCLES ? delay : TURNAROUND_CYCLES);
    wait_until_due();
  }
}
