// The commutator board on an ATmega328P at 16 MHz: figure 5 of the report, with the core as
// register R and timer T. Its eight motors have a latch of four windings each (KU), which a decoder
// chooses by the number of the motor (DN); the same number leads that motor's limit switches and
// its connection through multiplexers (PZ). Pins are in docs/firmware.md.
//
// F_start is set by eight switches behind a multiplexer of their own, the number of the motor being
// that of the switch. There are no interrupts: the loop takes some 12 us with a byte, which takes
// 20 us on the fastest line.
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdbool.h>

#define STROBE_D 0x20u
#include "firmware/ports/commutator/board.h"

#define COUNTS_PER_S (CYCLES_PER_S / 8UL)
#define PRESCALED_BY_8 (1 << CS11)

// Switches of F_start; PB3 .. PB5 are the programmer's, PC4 and PC5 are not used.
#define SWITCH_D 0x80u
#define INPUTS_B 0x3Fu

enum { SWITCHES_OF_START_HZ = 7 };

typedef struct clock {
  uint16_t last;
  uint16_t overflows;
} clock;

// In counts. Called far more often than the timer overflows, every 32.8 ms.
static uint32_t now(clock* c) {
  const uint16_t low = TCNT1;
  if (low < c->last) ++c->overflows;
  c->last = low;
  return (uint32_t)c->overflows << 16 | low;
}

static uint8_t read_start_hz(void) {
  uint8_t hz = 0;
  for (uint8_t i = SWITCHES_OF_START_HZ; i > 0; --i) {
    address((uint8_t)(i - 1u));
    hz = (uint8_t)(hz << 1 | ((PIND & SWITCH_D) == 0));
  }
  return hz;
}

// STROBE is high before it is driven: latches hear nothing of a reset.
static void begin_pins(void) {
  PORTB = INPUTS_B;
  PORTC = OTHERS_C;
  PORTD = STROBE_D | SUPPLY_D | SWITCH_D;
  DDRC = WINDINGS_C;
  DDRD = NUMBER_D | STROBE_D;
}

static void begin(bushd_commutator* board) {
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_enable(WDTO_120MS);
  begin_pins();
  const uint8_t start_hz = read_start_hz();
  // It takes no part, and leaves the latches as they are: at a speed that nobody meant motors would
  // lose steps. Who moves switches one by one is not to be read halfway.
  while (start_hz == 0 || start_hz > BUSHD_COMMUTATOR_MAX_START_HZ) wdt_reset();
  bushd_commutator_begin(board, start_hz, COUNTS_PER_S);
  begin_windings(board, (cause & (1 << PORF | 1 << BORF)) != 0);
  TCCR1B = PRESCALED_BY_8;
  begin_line();
}

static void hear(bushd_commutator* board, clock* c) {
  uint8_t byte;
  const heard what = hear_byte(&byte);
  if (what == HEARD_NOTHING) return;
  if (what == HEARD_DAMAGED) {
    bushd_commutator_receive_damaged(board);
  } else {
    bushd_commutator_receive(board, now(c), byte);
  }
}

// Answers are no closer than bytes that come, so there is room for one in UDR0.
static void step(bushd_commutator* board) {
  const uint8_t motor = board->motor;
  const bool done = bushd_commutator_step(board, read_inputs(motor));
  if (done) switch_windings(board, motor);
  UDR0 = bushd_commutator_status(done, read_inputs(motor));
}

int main(void) {
  bushd_commutator board;
  clock c = {0, 0};
  begin(&board);
  for (;;) {
    wdt_reset();
    hear(&board, &c);
    if (bushd_commutator_is_due(&board, now(&c))) step(&board);
  }
}
