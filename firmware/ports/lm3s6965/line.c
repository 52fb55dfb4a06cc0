// A timer starts an answer when it is due and then writes a byte whenever one is over: so the UART
// has no gaps, needs no interrupt for sending, and driver-enable falls when the last stop bit has
// ended.
#include "firmware/ports/lm3s6965/line.h"

#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/clock.h"
#include "firmware/ports/lm3s6965/flash.h"
#include "firmware/ports/lm3s6965/interrupts.h"
#include "firmware/ports/lm3s6965/timer.h"

#define LINE_TIMER TIMER(2)
// The UART's divisor, in 1/64, rounded; and what it makes of a byte, in cycles.
#define DIVISOR ((CYCLES_PER_US * 1000000u * 4u + BUSHD_BAUD / 2u) / BUSHD_BAUD)
#define BYTE_CYCLES ((DIVISOR * 10u + 3u) / 4u)
// One byte time belongs to the one who spoke last; a few cycles more for what is not exact.
#define TURNAROUND_CYCLES (BYTE_CYCLES + 100u)
// How often it is looked whether the last stop bit is over.
#define LOOK_CYCLES (BYTE_CYCLES / 40u)
#define SHORTEST_CYCLES 40

#define RECEIVED 1024u  // bytes that may wait while a tick is prepared; a power of two
#define DELIMITERS 64u  // of them

// Filled by line_received. Indices are never reduced but where they are used.
static uint8_t received[RECEIVED];
static volatile uint32_t received_in;
static uint32_t received_out;
static uint32_t delimiter_at[DELIMITERS];
static volatile uint32_t delimiters_in;
static uint32_t delimiters_out;
static uint32_t last_delimiter;

// Sent by line_due.
static const uint8_t* sending;
static const uint8_t* sending_end;
static enum { WAITS, SENDS, ENDS } phase;

void line_init(void) {
  timer_init(LINE_TIMER);
  UART_CTL = 0;
  UART_IBRD = DIVISOR >> 6;
  UART_FBRD = DIVISOR & 0x3Fu;
  UART_LCRH = 3u << 5;  // 8 bits; no FIFO: each byte interrupts when it has come
  UART_IM = 1u << 4;
  UART_CTL = 1u << 9 | 1u << 8 | 1u << 0;
  NVIC_ISER0 = 1u << IRQ_UART0 | 1u << IRQ_TIMER2A;
}

// The next but one byte would be lost while flash is written.
IN_RAM void line_received(void) {
  const uint32_t now = clock_now();
  while ((UART_FR & UART_FR_RXFE) == 0) {
    const uint8_t byte = (uint8_t)UART_DR;
    const bool delimiter = byte == 0 && delimiters_in - delimiters_out < DELIMITERS;
    if (received_in - received_out == RECEIVED) return;
    // A delimiter whose time cannot be kept becomes a byte that spoils its frame.
    received[received_in % RECEIVED] = byte == 0 && !delimiter ? 0xFFu : byte;
    if (delimiter) delimiter_at[delimiters_in++ % DELIMITERS] = now;
    ++received_in;
  }
}

bool line_has_frame_before(uint32_t time) {
  return delimiters_in != delimiters_out &&
         clock_since(delimiter_at[delimiters_out % DELIMITERS], time) < 0;
}

bool line_take(uint8_t* byte, uint32_t* time) {
  if (received_in == received_out) return false;
  *byte = received[received_out % RECEIVED];
  if (*byte == 0) *time = last_delimiter = delimiter_at[delimiters_out++ % DELIMITERS];
  ++received_out;
  return true;
}

void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns) {
  const uint32_t delay = delay_ns / CYCLE_NS;
  interrupts_off();
  timer_stop(LINE_TIMER);
  sending = wire;
  sending_end = wire + size;
  phase = WAITS;
  const int32_t left = (int32_t)(delay > TURNAROUND_CYCLES ? delay : TURNAROUND_CYCLES) -
                       clock_since(clock_now(), last_delimiter);
  timer_start(LINE_TIMER, TIMER_ONE_SHOT,
              (uint32_t)(left > SHORTEST_CYCLES ? left : SHORTEST_CYCLES));
  interrupts_on();
}

void line_due(void) {
  TIMER_ICR(LINE_TIMER) = 1;
  if (phase == WAITS) {
    phase = SENDS;
    DRIVER_ENABLE = ALL_PINS;
    timer_stop(LINE_TIMER);
    timer_start(LINE_TIMER, TIMER_PERIODIC, BYTE_CYCLES);
  }
  if (phase == SENDS && sending != sending_end) {
    UART_DR = *sending++;
    return;
  }
  timer_stop(LINE_TIMER);
  if ((UART_FR & UART_FR_BUSY) != 0) {
    phase = ENDS;
    timer_start(LINE_TIMER, TIMER_ONE_SHOT, LOOK_CYCLES);
  } else {
    DRIVER_ENABLE = 0;
  }
}
