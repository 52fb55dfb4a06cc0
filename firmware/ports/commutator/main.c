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

#include "firmware/commutator/commutator.h"

#define CYCLES_PER_S 16000000UL
#define COUNTS_PER_S (CYCLES_PER_S / 8UL)
#define PRESCALED_BY_8 (1 << CS11)

// Eight samples a bit. The data sheet (8N1, double speed) recommends no more than 1.5 %.
#define DIVIDER ((CYCLES_PER_S / 8UL + BUSHD_COMMUTATOR_BAUD / 2UL) / BUSHD_COMMUTATOR_BAUD)
#define ACTUAL_BAUD (CYCLES_PER_S / 8UL / DIVIDER)
_Static_assert(ACTUAL_BAUD * 1000UL <= BUSHD_COMMUTATOR_BAUD * 1015UL &&
                   ACTUAL_BAUD * 1000UL >= BUSHD_COMMUTATOR_BAUD * 985UL,
               "16 MHz make no such baud rate");
_Static_assert(DIVIDER <= 4096, "the divisor has 12 bits");

// Windings at PC0 .. PC3; the latch of the motor takes them with the rising edge of STROBE. PC4 and
// PC5 are not used.
#define WINDINGS_C 0x0Fu
#define UNUSED_C 0x30u
// Number of the motor at PD2 .. PD4, STROBE at PD5.
#define FIRST_NUMBER 2u
#define NUMBER_D 0x1Cu
#define STROBE_D 0x20u
// Inputs, pulled up: active, present, connected and on are low.
#define SUPPLY_D 0x40u
#define SWITCH_D 0x80u
#define RIGHT_LIMIT_B 1u
#define LEFT_LIMIT_B 2u
#define CONNECTED_B 4u
// PB3 .. PB5 are the programmer's.
#define INPUTS_B 0x3Fu

enum { SWITCHES_OF_START_HZ = 7 };

// The latches keep windings through a reset by the watchdog, so RAM keeps what they are.
typedef struct kept_phase {
  uint8_t phase;
  uint8_t inverted;
} kept_phase;
static kept_phase kept[BUSHD_COMMUTATOR_MOTORS] __attribute__((section(".noinit")));

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

static void address(uint8_t number) {
  PORTD = (uint8_t)((PORTD & ~NUMBER_D) | (uint8_t)(number << FIRST_NUMBER));
  // Multiplexer and synchroniser: 0.1 us, and two cycles.
  __builtin_avr_delay_cycles(4);
}

static uint8_t read_inputs(uint8_t motor) {
  address(motor);
  const uint8_t b = PINB;
  uint8_t inputs = 0;
  if ((b & RIGHT_LIMIT_B) == 0) inputs |= BUSHD_COMMUTATOR_RIGHT_LIMIT;
  if ((b & LEFT_LIMIT_B) == 0) inputs |= BUSHD_COMMUTATOR_LEFT_LIMIT;
  if ((b & CONNECTED_B) != 0) inputs |= BUSHD_COMMUTATOR_NOT_CONNECTED;
  if ((PIND & SUPPLY_D) != 0) inputs |= BUSHD_COMMUTATOR_SUPPLY_MISSING;
  return inputs;
}

static void switch_windings(const bushd_commutator* board, uint8_t motor) {
  const uint8_t phase = board->phase[motor];
  kept[motor] = (kept_phase){phase, (uint8_t)~phase};
  address(motor);
  PORTC = (uint8_t)(UNUSED_C | bushd_commutator_windings(board, motor));
  PORTD &= (uint8_t)~STROBE_D;
  PORTD |= STROBE_D;
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
  PORTC = UNUSED_C;
  PORTD = STROBE_D | SUPPLY_D | SWITCH_D;
  DDRC = WINDINGS_C;
  DDRD = NUMBER_D | STROBE_D;
}

// A motor of which RAM has lost the phase goes to phase 0, two steps away at most.
static void begin_windings(bushd_commutator* board, bool power_came) {
  for (uint8_t m = 0; m < BUSHD_COMMUTATOR_MOTORS; ++m) {
    const uint8_t phase = kept[m].phase;
    const bool is_kept = phase < BUSHD_COMMUTATOR_PHASES && (phase ^ kept[m].inverted) == 0xFF;
    board->phase[m] = is_kept && !power_came ? phase : 0;
    switch_windings(board, m);
  }
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
  UCSR0A = 1 << U2X0;
  UBRR0 = DIVIDER - 1;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
}

static void hear(bushd_commutator* board, clock* c) {
  // The status belongs to the byte that is read next.
  const uint8_t status = UCSR0A;
  if ((status & 1 << RXC0) == 0) return;
  const uint8_t byte = UDR0;
  if (status & (1 << FE0 | 1 << DOR0)) {
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
