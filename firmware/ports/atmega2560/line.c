#include "firmware/ports/atmega2560/line.h"

#include <avr/interrupt.h>
#include <board.h>

#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/line_interrupts.h"

#define BIT_PERIODS (CYCLES_PER_US * 1000000UL / BUSHD_AVR_BAUD)
// With U2X, the only way to the high rates; rounded.
#define DIVISOR ((CYCLES_PER_US * 1000000UL + 4UL * BUSHD_AVR_BAUD) / (8UL * BUSHD_AVR_BAUD) - 1UL)
// One byte time belongs to the one who spoke last; a few cycles more for what is not exact.
#define TURNAROUND_CYCLES (10UL * BIT_PERIODS + 100UL)
// So many at a time go through the CRC before a frame ends.
#define CHECK_BYTES 24u
#define SKIPPED_BYTES 64u
_Static_assert(LINE_REPLY_AT >= 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC + 2 * CHECK_BYTES,
               "what others answer needs less (bushd_receiver_pass_reply)");
// What timer 3 waits for at least, and at most at a time: in its counts.
#define SHORTEST_COUNTS (64UL / LINE_COUNT_CYCLES)
#define TURN_COUNTS 30000UL
#define WAITING (1 << OCIE3A)

// Filled by line_interrupts.S.
// At the end of RAM (CMakeLists.txt), above the stack.
uint8_t line_bytes[256] __attribute__((section(".line_bytes,\"aw\",@nobits;")));
volatile uint16_t line_stamps[LINE_DELIMITERS];
volatile uint8_t line_stamps_in;
static uint8_t stamps_out;
static uint32_t last_delimiter;

volatile uint8_t line_sending_end;
static uint32_t counts_to_wait;

// Timer 3 runs freely; until an answer is due it may take several turns. None is short.
static uint16_t next_turn(void) {
  const uint16_t turn = (uint16_t)(counts_to_wait < 2 * TURN_COUNTS ? counts_to_wait : TURN_COUNTS);
  counts_to_wait -= turn;
  return turn;
}

static inline void wait_until(uint16_t count) {
  line_timer_wait(count);
  TIFR3 = 1 << OCF3A;
  TIMSK3 = LINE_OTHER_INTERRUPTS | WAITING;
}

ISR(TIMER3_COMPA_vect, ISR_NOBLOCK) {
  TIMSK3 = LINE_OTHER_INTERRUPTS;
  if (counts_to_wait != 0) {
    wait_until((uint16_t)(OCR3A + next_turn()));
    return;
  }
  DE_PORT |= 1 << DE_BIT;
  UCSR0B = 1 << TXEN0 | 1 << UDRIE0;
}

void line_init(void) {
  LINE_IN = LINE_OUT = 0;
  line_timer_start();
  UCSR0A = 1 << U2X0;
  UBRR0H = (uint8_t)(DIVISOR >> 8);
  UBRR0L = (uint8_t)DIVISOR;
  UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
  UCSR0B = 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0;
}

// The time of the delimiter that is taken next. False if too many wait for all to have theirs.
static bool delimiter_time(uint32_t* time) {
  if ((uint8_t)(line_stamps_in - stamps_out) > LINE_DELIMITERS) return false;
  *time = clock_at(line_stamps[stamps_out % LINE_DELIMITERS]);
  return true;
}

uint8_t* line_reply(bushd_receiver* receiver) {
  return receiver->buffer + LINE_REPLY_AT;
}

static inline bool is_sending(void) {
  return (UCSR0B & 1 << RXEN0) == 0;
}

// An answer waits, or is being sent.
static inline bool has_reply(void) {
  return (TIMSK3 & WAITING) != 0 || is_sending();
}

// Room in the buffer. What others answer finds it before an answer that waits. A master that speaks
// then waits for it no more: it gives way as soon as the frame needs its place.
static uint16_t room_for(const bushd_receiver* receiver, uint8_t more) {
  if (!has_reply()) return sizeof receiver->buffer;
  const bool fits = receiver->size + more <= LINE_REPLY_AT || receiver->size > LINE_REPLY_AT;
  if (fits || (receiver->buffer[2] & BUSHD_TYPE_REPLY) != 0) return LINE_REPLY_AT;
  TIMSK3 = LINE_OTHER_INTERRUPTS;
  return is_sending() ? LINE_REPLY_AT : sizeof receiver->buffer;
}

static void collect(bushd_receiver* receiver) {
  uint8_t out = LINE_OUT;
  uint8_t left = (uint8_t)(LINE_IN - out);
  if (left > CHECK_BYTES) left = CHECK_BYTES;
  const uint16_t room = room_for(receiver, left);
  if (left != 0 && receiver->size + left <= room) {
    uint8_t* to = receiver->buffer + receiver->size;
    out = line_decode(&to, &receiver->run, out, left);
    receiver->size = (uint16_t)(to - receiver->buffer);
  } else {
    for (; left > 0; --left, ++out) {
      const uint8_t byte = line_bytes[out];
      if (byte != 0 && receiver->size >= room) receiver->size = BUSHD_FRAME_OVERLONG;
      if (!bushd_receiver_collect(receiver, byte)) break;
    }
  }
  LINE_OUT = out;
}

// Those that end no frame: every transmitter sends one first, and noise may be nothing else. The
// way through the core takes several byte times for each; MCUs would fall behind a line full of
// them.
static void skip_delimiters(void) {
  uint8_t out = LINE_OUT;
  uint8_t left = (uint8_t)(LINE_IN - out);
  if (left > SKIPPED_BYTES) left = SKIPPED_BYTES;
  for (; left > 0 && line_bytes[out] == 0; --left, ++out) ++stamps_out;
  LINE_OUT = out;
}

static inline bool has_unchecked(const bushd_receiver* receiver) {
  return receiver->size != BUSHD_FRAME_OVERLONG &&
         (uint16_t)(receiver->size - receiver->checked) > CHECK_BYTES;
}

bool line_collect(bushd_receiver* receiver, uint32_t* time) {
  if (has_unchecked(receiver)) {
    bushd_receiver_check(receiver);
    bushd_receiver_pass_reply(receiver);
  } else {
    if (receiver->size == 0) skip_delimiters();
    collect(receiver);
  }
  if (receiver->size == 0 || LINE_OUT == LINE_IN || line_bytes[LINE_OUT] != 0) return false;
  // Without it, its frame will not be good.
  if (!delimiter_time(time)) *time = clock_now();
  return true;
}

bool line_is_idle(void) {
  return LINE_OUT == LINE_IN;
}

bool line_may_take(const bushd_receiver* receiver) {
  // Less is no frame, but what a transceiver makes of its switching on.
  const bool whole = receiver->size >= 1 + BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC;
  if (whole && (receiver->buffer[2] & BUSHD_TYPE_REPLY) == 0) TIMSK3 = LINE_OTHER_INTERRUPTS;
  return !is_sending();
}

void line_take(bushd_receiver* receiver) {
  // Nobody may go by a frame whose end's time is not known.
  if (!delimiter_time(&last_delimiter)) receiver->size = BUSHD_FRAME_OVERLONG;
  ++stamps_out;
  LINE_OUT = (uint8_t)(LINE_OUT + 1u);
}

void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns) {
  // Reply windows are whole multiples of 10 us.
  const uint32_t delay = delay_ns / 1000u * CYCLES_PER_US;
  const uint32_t due = last_delimiter + (delay > TURNAROUND_CYCLES ? delay : TURNAROUND_CYCLES);
  TIMSK3 = LINE_OTHER_INTERRUPTS;
  line_set_sending(wire);
  line_sending_end = (uint8_t)(uintptr_t)(wire + size);
  const uint32_t now = clock_now();
  const bool early = clock_before(now + SHORTEST_COUNTS * LINE_COUNT_CYCLES, due);
  counts_to_wait = early ? (due - now) / LINE_COUNT_CYCLES : SHORTEST_COUNTS;
  const uint16_t turn = next_turn();
  // With interrupts on, so that no slot waits for it. If they took so long that the count was
  // passed before it was set, the compare would come a turn of the timer later.
  for (;;) {
    const uint16_t begin = line_timer_now();
    wait_until((uint16_t)(begin + turn));
    if ((uint16_t)(line_timer_now() - begin) < turn) return;
    TIMSK3 = LINE_OTHER_INTERRUPTS;
    if (is_sending()) return;
  }
}
