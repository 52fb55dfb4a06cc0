// The keypad node of the source document on an ATmega328P at 16 MHz: four keys, a line of 625 baud
// to the MCU that has the motor, and a display of four digits for what that sends back. It needs
// nothing of the core but the bytes (firmware/core/keypad.h). Pins are in docs/firmware.md.
//
// A key sends its byte when it is pressed. A direction is sent again ten times a second as long as
// its key is held, for a motor that is to stop without it; "slower" and "stop" once.
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdbool.h>

#include "firmware/core/keypad.h"

#define CYCLES_PER_S 16000000UL
#define DIVISOR (CYCLES_PER_S / (16UL * BUSHD_KEYPAD_BAUD) - 1UL)
#define TIMER_PRESCALER 64UL
#define PRESCALED_BY_64 (1 << CS01 | 1 << CS00)
#define COUNTS_PER_MS (CYCLES_PER_S / 1000UL / TIMER_PRESCALER)

enum { DEBOUNCE_MS = 10, REPEAT_MS = 100, DIGITS = 4 };

// Keys, to ground: PC0 forward, PC1 reverse, PC2 slower, PC3 stop.
#define KEYS 0x0Fu
// Segments a .. f at PD2 .. PD7, g at PB0; digits at PB1 .. PB4, the first one at PB1. High: on.
#define SEGMENTS_D 0xFCu
#define SEGMENT_G 1u
#define FIRST_DIGIT 1u
#define OUTPUTS_B 0x1Fu

// Bytes of keys, and three that are none.
typedef enum key {
  FORWARD = 0x00,
  NONE = 0x01,
  RELEASE_FIRST = 0x02,  // held at boot, perhaps stuck, or the rest of several
  SEVERAL = 0x03,
  STOP = 0xFD,
  SLOWER = 0xFE,
  REVERSE = 0xFF
} key;

typedef struct keys {
  key counts;
  key read;         // what the pins say
  uint8_t read_ms;  // for so long
  uint8_t repeat_ms;
} keys;

typedef struct display {
  char coming[DIGITS];
  uint8_t count;  // of them; more than DIGITS: it is no text
  char shown[DIGITS];
  uint8_t lit;
} display;

static key read_keys(void) {
  switch ((uint8_t)~PINC & KEYS) {
    case 0:
      return NONE;
    case 1:
      return FORWARD;
    case 2:
      return REVERSE;
    case 4:
      return SLOWER;
    case 8:
      return STOP;
    default:
      return SEVERAL;
  }
}

// Every ms.
static void follow_keys(keys* k) {
  const key now = read_keys();
  if (now != k->read) {
    k->read = now;
    k->read_ms = 0;
  }
  if (k->read_ms < DEBOUNCE_MS) ++k->read_ms;
  if (k->repeat_ms < REPEAT_MS) ++k->repeat_ms;
  // Nothing is forgotten for a line that is busy: the key waits.
  if (k->read_ms < DEBOUNCE_MS || (UCSR0A & 1 << UDRE0) == 0) return;
  const bool is_new = now != k->counts && !(k->counts == RELEASE_FIRST && now != NONE);
  const bool again =
      now == k->counts && (now == FORWARD || now == REVERSE) && k->repeat_ms == REPEAT_MS;
  if (!is_new && !again) return;
  // Several keys at once stop the motor; that which is released last means nothing.
  k->counts = now == SEVERAL ? RELEASE_FIRST : now;
  k->repeat_ms = 0;
  if (now != NONE) UDR0 = (uint8_t)(now == SEVERAL ? STOP : now);
}

static uint8_t segments_of(char character) {
  static const uint8_t kDigits[] = {0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F};
  if (character >= '0' && character <= '9') return kDigits[character - '0'];
  return character == '-' ? 0x40 : 0;
}

// Every ms the next digit.
static void light(display* d) {
  d->lit = (uint8_t)(d->lit + 1u) % DIGITS;
  const uint8_t segments = segments_of(d->shown[d->lit]);
  PORTB = 0;
  PORTD = (uint8_t)(segments << 2) & SEGMENTS_D;
  const uint8_t digit = (uint8_t)(1u << (FIRST_DIGIT + d->lit));
  PORTB = (uint8_t)(digit | (segments & 0x40 ? SEGMENT_G : 0u));
}

static void take_character(display* d, char character) {
  if (character != '\n') {
    if (d->count < DIGITS) d->coming[d->count] = character;
    if (d->count <= DIGITS) ++d->count;
    return;
  }
  for (uint8_t i = 0; d->count == DIGITS && i < DIGITS; ++i) d->shown[i] = d->coming[i];
  d->count = 0;
}

static void hear(display* d) {
  const uint8_t status = UCSR0A;
  if ((status & 1 << RXC0) == 0) return;
  const char character = (char)UDR0;
  if (status & (1 << FE0 | 1 << DOR0)) {
    d->count = DIGITS + 1;
  } else {
    take_character(d, character);
  }
}

static void begin(void) {
  PORTC = KEYS;
  DDRB = OUTPUTS_B;
  DDRD = SEGMENTS_D;
  UBRR0 = DIVISOR;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
  OCR0A = COUNTS_PER_MS - 1;
  TCCR0A = 1 << WGM01;
  TCCR0B = PRESCALED_BY_64;
  wdt_enable(WDTO_120MS);
}

int main(void) {
  keys k = {RELEASE_FIRST, NONE, 0, 0};
  display d = {{0}, 0, {0}, 0};
  begin();
  for (;;) {
    hear(&d);
    if ((TIFR0 & 1 << OCF0A) == 0) continue;
    TIFR0 = 1 << OCF0A;
    wdt_reset();
    follow_keys(&k);
    light(&d);
  }
}
