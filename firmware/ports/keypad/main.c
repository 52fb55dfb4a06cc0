// The keypad node of the source document on an ATmega328P at 16 MHz: keys, a line of 625 baud to
// the MCU that has the motor, and a display of four digits for what that sends back. It needs
// nothing of the core but the bytes (firmware/core/keypad.h). Pins are in docs/firmware.md.
//
// As in the document the display shows Z after "forward", F after "reverse" and ---- after "stop"
// for a moment, and then the delay of a step. The moment begins when the MCU has answered the key:
// what it has not taken is not shown. Where it answers with ---- itself, that stays.
#include <avr/io.h>
#include <avr/wdt.h>

#include "firmware/core/keypad.h"
#include "firmware/ports/keypad/keys.h"

#define CYCLES_PER_S 16000000UL
#define DIVISOR (CYCLES_PER_S / (16UL * BUSHD_KEYPAD_BAUD) - 1UL)
#define TIMER_PRESCALER 64UL
#define PRESCALED_BY_64 (1 << CS01 | 1 << CS00)
#define COUNTS_PER_MS (CYCLES_PER_S / 1000UL / TIMER_PRESCALER)

// The document's loop of 62500 takes some 0.4 s.
enum { DEBOUNCE_MS = 10, WORD_MS = 400, DIGITS = 4 };

// Segments a .. f at PD2 .. PD7, g at PB0; digits at PB1 .. PB4, the first one at PB1. High: on.
#define SEGMENTS_D 0xFCu
#define SEGMENT_G 1u
#define FIRST_DIGIT 1u
#define OUTPUTS_B 0x1Fu

typedef struct contacts {
  uint8_t closed;  // what the pins say
  uint8_t ms;      // for so long
} contacts;

typedef struct display {
  char coming[DIGITS];
  uint8_t count;  // of them; more than DIGITS: it is no text
  char shown[DIGITS];
  uint8_t lit;
  char asked;        // the word of a key that the MCU has not answered; 0: none
  bool is_older;     // the text that is coming began before that key
  char word;         // in the place of what is shown, for word_ms
  uint16_t word_ms;  // left
} display;

static char word_of(key_byte byte) {
  if (byte == FORWARD) return 'Z';
  if (byte == REVERSE) return 'F';
  return byte == STOP ? '-' : 0;
}

// Every ms.
static void follow_contacts(contacts* c, keys* k, display* d) {
  const uint8_t closed = (uint8_t)~PINC & CONTACTS;
  if (closed != c->closed) {
    c->closed = closed;
    c->ms = 0;
  }
  if (c->ms < DEBOUNCE_MS) ++c->ms;
  if (c->ms < DEBOUNCE_MS) return;
  wish w;
  if (!keys_follow(k, closed, (UCSR0A & 1 << UDRE0) != 0, &w)) return;
  UDR0 = (uint8_t)w.byte;
  if (!w.is_new) return;
  d->asked = word_of(w.byte);
  d->is_older = d->count != 0;
  d->word_ms = 0;
}

static uint8_t segments_of(char character) {
  static const uint8_t kDigits[] = {0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F};
  if (character >= '0' && character <= '9') return kDigits[character - '0'];
  if (character == 'Z') return 0x5B;
  if (character == 'F') return 0x71;
  return character == '-' ? 0x40 : 0;
}

static char character_at(const display* d, uint8_t digit) {
  if (d->word_ms == 0) return d->shown[digit];
  return digit == DIGITS - 1 || d->word == '-' ? d->word : 0;
}

// Every ms the next digit.
static void light(display* d) {
  if (d->word_ms > 0) --d->word_ms;
  d->lit = (uint8_t)(d->lit + 1u) % DIGITS;
  const uint8_t segments = segments_of(character_at(d, d->lit));
  PORTB = 0;
  PORTD = (uint8_t)(segments << 2) & SEGMENTS_D;
  const uint8_t digit = (uint8_t)(1u << (FIRST_DIGIT + d->lit));
  PORTB = (uint8_t)(digit | (segments & 0x40 ? SEGMENT_G : 0u));
}

static void take_text(display* d) {
  for (uint8_t i = 0; i < DIGITS; ++i) d->shown[i] = d->coming[i];
  const bool is_refusal = d->shown[0] == '-';
  if (is_refusal) d->word_ms = 0;
  if (!d->is_older) {
    if (d->asked != 0 && !is_refusal) {
      d->word = d->asked;
      d->word_ms = WORD_MS;
    }
    d->asked = 0;
  }
  d->is_older = false;
}

static void take_character(display* d, char character) {
  if (character != '\n') {
    if (d->count < DIGITS) d->coming[d->count] = character;
    if (d->count <= DIGITS) ++d->count;
    return;
  }
  if (d->count == DIGITS) take_text(d);
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
  PORTC = CONTACTS;
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
  contacts c = {0, 0};
  keys k = {0, 0, 0, false, false};
  display d = {{0}, 0, {0}, 0, 0, false, 0, 0};
  begin();
  for (;;) {
    hear(&d);
    if ((TIFR0 & 1 << OCF0A) == 0) continue;
    TIFR0 = 1 << OCF0A;
    wdt_reset();
    follow_contacts(&c, &k, &d);
    light(&d);
  }
}
