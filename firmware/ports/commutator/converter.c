// The commutator board whose steps are pulses of a voltage-to-frequency converter, on an ATmega328P
// at 16 MHz. It is the board of main.c without switches of F_start: in their place timer 1 counts
// the converter's pulses at PD5, its input T1, and the strobe is at PD7. K goes out in parallel to
// a latch of eight bits before the DAC: its lower six bits at port C, four of them in common with
// the windings, the other two at PB3 and PB4.
//
// There are no interrupts. Pulses are counted while the program looks elsewhere.
#include <avr/io.h>
#include <avr/wdt.h>

#define STROBE_D 0x80u
#include "firmware/commutator/converter.h"
#include "firmware/ports/commutator/board.h"

#define PULSES_D 0x20u
#define INPUTS_B (RIGHT_LIMIT_B | LEFT_LIMIT_B | CONNECTED_B)
// The programmer's pins too, which it has while the chip is in reset.
#define HIGH_CODE_B 0x18u
#define HIGH_CODE_SHIFT 3u
#define CODE_CLOCK_B 0x20u
#define LOW_CODE_C 0x3Fu
#define LOW_CODE_BITS 6u

#define RISING_EDGES_AT_T1 (1 << CS12 | 1 << CS11 | 1 << CS10)
// Timer 0 overflows every 16.384 ms. The watch is over with the 63rd time, after 1.016 to 1.032 s.
#define PRESCALED_BY_1024 (1 << CS02 | 1 << CS00)
#define OVERFLOW_US (256UL * 1024UL / (CYCLES_PER_S / 1000000UL))
#define WATCH_OVERFLOWS ((BUSHD_CONVERTER_WATCH_MS * 1000UL + OVERFLOW_US - 1UL) / OVERFLOW_US)

// In overflows. Called far more often than the timer does so.
static uint16_t now(uint16_t* overflows) {
  if (TIFR0 & 1 << TOV0) {
    TIFR0 = 1 << TOV0;
    ++*overflows;
  }
  return *overflows;
}

static void set_code(uint8_t code) {
  PORTC = code & LOW_CODE_C;
  PORTB = (uint8_t)(INPUTS_B | (uint8_t)(code >> LOW_CODE_BITS << HIGH_CODE_SHIFT));
  PORTB |= CODE_CLOCK_B;
}

// Strobe and clock are high before they are driven: latches hear nothing of a reset.
static void begin_pins(void) {
  PORTB = INPUTS_B | CODE_CLOCK_B;
  PORTC = 0;
  PORTD = STROBE_D | SUPPLY_D | PULSES_D;
  DDRB = HIGH_CODE_B | CODE_CLOCK_B;
  DDRC = LOW_CODE_C;
  DDRD = NUMBER_D | STROBE_D;
}

static void begin(bushd_converter* converter) {
  const uint8_t cause = MCUSR;
  MCUSR = 0;
  wdt_enable(WDTO_120MS);
  begin_pins();
  set_code(0);
  bushd_converter_begin(converter, WATCH_OVERFLOWS);
  begin_windings(&converter->board, (cause & (1 << PORF | 1 << BORF)) != 0);
  TCCR0B = PRESCALED_BY_1024;
  TCCR1B = RISING_EDGES_AT_T1;
  begin_line();
}

static void hear(bushd_converter* converter, uint16_t time) {
  uint8_t byte;
  const heard what = hear_byte(&byte);
  if (what == HEARD_NOTHING) return;
  if (what == HEARD_DAMAGED) {
    bushd_converter_receive_damaged(converter);
  } else {
    bushd_converter_receive(converter, time, TCNT1, byte);
  }
  set_code(converter->code);
}

// K first: from the pulse to 0 the converter goes on at the speed of before.
static void step(bushd_converter* converter, uint16_t pulses) {
  set_code(0);
  const uint8_t motor = converter->board.motor;
  const uint8_t made = bushd_converter_step(converter, pulses, read_inputs(motor));
  if (made & BUSHD_COMMUTATOR_STEP_DONE) switch_windings(&converter->board, motor);
  UDR0 = made | read_inputs(motor);
}

int main(void) {
  bushd_converter converter;
  uint16_t overflows = 0;
  begin(&converter);
  for (;;) {
    wdt_reset();
    const uint16_t time = now(&overflows);
    hear(&converter, time);
    const uint16_t pulses = TCNT1;
    if (bushd_converter_is_due(&converter, time, pulses)) step(&converter, pulses);
  }
}
