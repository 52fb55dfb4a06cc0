#include "firmware/ports/atmega2560/line.h"

#include <avr/interrupt.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/line_interrupts.h"

#define BIT_PERIODS (CYCLES_PER_US * 1000000UL / BUSHD_AVR_BAUD)
// With U2X, the only way to the high rates; rounded.
#define DIVISOR ((CYCLES_PER_US * 1000000UL + 4UL * BUSHD_AVR_BAUD) / (8UL * BUSHD_AVR_BAUD) - 1UL)
// One byte time belongs to the one who spoke last; a few cycles more for what is not exact.
#define TURNAROUND_CYCLES (10UL * BIT_PERIODS + 100UL)
// So many at a time go through the CRC before a frame ends.
#define CHECK_BYTES 24u
// What timer 3 is set to at least and at most.
#define SHORTEST_CYCLES 16UL
#define LONGEST_CYCLES 60000UL

// Filled by line_interrupts.S. Indices of bytes wrap with their type.
uint8_t line_bytes[256];
volatile uint8_t line_in;
volatile uint8_t line_out;
volatile line_stamp line_stamps[LINE_DELIMITERS];
volatile uint8_t line_stamps_in;
volatile uint8_t line_stamps_out;
static uint32_t last_delimiter;

// Sent by it.
const uint8_t* volatile line_sending;
volatile uint8_t line_sending_end;  // low byte of the address behind the last one
static uint32_t sending_due;

// Timer 3 waits until an answer is due, in several turns if need be.
static void wait_until_due(void) {
  const uint32_t now = clock_now();
  uint32_t left = clock_before(now, sending_due) ? sending_due - now : 0;
  if (left < SHORTEST_CYCLES) left = SHORTEST_CYCLES;
  TCNT3 = 0;
  OCR3A = (uint16_t)(left < LONGEST_CYCLES ? left : LONGEST_CYCLES);
  TIFR3 = 1 << OCF3A;
  TIMSK3 = 1 << OCIE3A;
  TCCR3B = 1 << CS30;
}

ISR(TIMER3_COMPA_vect, ISR_NOBLOCK) {
  TCCR3B = 0;
  TIMSK3 = 0;
  if (clock_before(clock_now(), sending_due)) {
    wait_until_due();
    return;
  }
  DE_PORT |= 1 << DE_BIT;
  UCSR0B = 1 << TXEN0 | 1 << UDRIE0;
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

static uint32_t stamped_time(uint8_t index) {
  const uint16_t low = line_stamps[index].low;
  const uint8_t overflows = line_stamps[index].overflows & 0x7F;
  uint16_t high = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    high = clock_overflows;
  }
  // Seven bits are kept, half a second.
  high = (uint16_t)(high - (((uint8_t)high - overflows) & 0x7F));
  const bool pending = (line_stamps[index].overflows & 0x80) != 0;
  if (pending && low < 0x8000u) ++high;
  return (uint32_t)high << 16 | low;
}

bool line_collect(bushd_receiver* receiver, uint32_t* time) {
  uint8_t out = line_out;
  const uint8_t in = line_in;
  while (out != in && bushd_receiver_collect(receiver, line_bytes[out])) ++out;
  line_out = out;
  if ((uint16_t)(receiver->size - receiver->checked) > CHECK_BYTES) bushd_receiver_check(receiver);
  if (out == in) return false;
  // One byte too many for a frame must not hold up a tick: it has just come.
  *time = line_bytes[out] == 0 ? stamped_time(line_stamps_out % LINE_DELIMITERS) : clock_now();
  return true;
}

uint8_t line_take(void) {
  const uint8_t byte = line_bytes[line_out];
  if (byte == 0) {
    last_delimiter = stamped_time(line_stamps_out % LINE_DELIMITERS);
    line_stamps_out = (uint8_t)(line_stamps_out + 1u);
  }
  line_out = (uint8_t)(line_out + 1u);
  return byte;
}

void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns) {
  // Reply slots are whole multiples of 10 us.
  const uint32_t delay = delay_ns / 1000u * CYCLES_PER_US;
  TIMSK3 = 0;
  line_sending = wire;
  line_sending_end = (uint8_t)(uintptr_t)(wire + size);
  sending_due = last_delimiter + (delay > TURNAROUND_CYCLES ? delay : TURNAROUND_CYCLES);
  wait_until_due();
}
