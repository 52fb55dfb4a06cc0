#include "fuzz/atmega2560/port.h"

#include <avr/interrupt.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/eeprom.h"
#include "firmware/ports/atmega2560/line_interrupts.h"

// The very files. Sections and such mean nothing here.
#define __attribute__(list)
#define BUSHD_AVR_BAUD 1000000UL
// Structs of an 8-bit CPU have no gaps.
#pragma pack(push, 1)
#include "firmware/ports/atmega2560/nvm.c"
#pragma pack(pop)
#include "firmware/ports/atmega2560/line.c"
#undef __attribute__

#define EEPROM_SIZE (E2END + 1u)
#define CYCLES_A_CALL 400u

volatile uint8_t PORTA, PORTB, PORTC, PORTD, PORTE, PORTF, PORTH, PORTJ, PORTK, PORTL;
volatile uint8_t DDRA, DDRB, DDRC, DDRE, DDRF, DDRG, DDRH, DDRL;
volatile uint8_t GPIOR1, GPIOR2, OCR0A, OCR0B, OCR2A, OCR2B;
volatile uint8_t GTCCR, TCCR3B, TCCR4B, TCCR5B, TIMSK3, TIFR3;
volatile uint16_t TCNT3, OCR3A;
volatile uint8_t UCSR0A, UCSR0B, UCSR0C, UBRR0H, UBRR0L;
const uint32_t image_seal = 0x5EA1ED01;
volatile bool eeprom_writes;

static uint8_t eeprom[EEPROM_SIZE];
static uint32_t cycles;

// Beyond it an address wraps, and hits the identity. Below EEPROM_NVM that is whose it is.
static void require_nvm_area(size_t address, size_t size) {
  if (address < EEPROM_NVM || address + size > EEPROM_SIZE) abort();
}

void eeprom_read_block(void* to, const void* from, size_t size) {
  require_nvm_area((size_t)from, size);
  memcpy(to, eeprom + (size_t)from, size);
}

uint8_t eeprom_read_byte(const uint8_t* at) {
  require_nvm_area((size_t)at, 1);
  return eeprom[(size_t)at];
}

void eeprom_write_byte(uint8_t* at, uint8_t byte) {
  require_nvm_area((size_t)at, 1);
  eeprom[(size_t)at] = byte;
}

void eeprom_write(uint16_t address, uint8_t byte) {
  if (eeprom_writes) abort();
  if (eeprom_byte(address) == byte) return;
  eeprom_write_byte((uint8_t*)(size_t)address, byte);
  eeprom_writes = true;
}

uint32_t clock_now(void) {
  return cycles += CYCLES_A_CALL;
}

uint32_t clock_at(uint16_t count) {
  const uint32_t now = clock_now();
  return now - (uint16_t)((uint16_t)(now / CLOCK_CYCLES) - count) * (uint32_t)CLOCK_CYCLES;
}

// As receive.S does it.
uint8_t line_decode(uint8_t** to, uint8_t* run, uint8_t out, uint8_t count) {
  for (; count > 0; --count, ++out) {
    const uint8_t byte = line_bytes[out];
    if (byte == 0) break;
    const bool distance = *run == 0;
    *run = (uint8_t)((distance ? byte : *run) - 1u);
    *(*to)++ = distance ? 0 : byte;
  }
  return out;
}

void host_reset(void) {
  phase = COMPARE;
  memset(&scan, 0, sizeof scan);
  planned = 0;
  in_head = 0;
  stamps_out = line_stamps_in = line_sending_end = 0;
  last_delimiter = counts_to_wait = cycles = 0;
  TIMSK3 = PORTE = 0;
  eeprom_writes = false;
  line_init();
}

void host_blank_eeprom(void) {
  memset(eeprom, 0xFF, sizeof eeprom);
}

uint16_t host_nvm_size(void) {
  return read_head().size;
}

uint32_t host_nvm_crc(void) {
  return read_head().crc;
}

bushd_mcu_nvm_scan host_walk(void) {
  return scan;
}

void host_receive(uint8_t byte) {
  if ((UCSR0B & 1 << RXEN0) == 0) return;
  const uint8_t next = (uint8_t)(LINE_IN + 1u);
  if (next == LINE_OUT) return;
  line_bytes[LINE_IN] = byte;
  LINE_IN = next;
  if (byte != 0) return;
  line_stamps[line_stamps_in % LINE_DELIMITERS] = (uint16_t)(clock_now() / CLOCK_CYCLES);
  line_stamps_in = (uint8_t)(line_stamps_in + 1u);
}

bool host_has_reply(void) {
  return has_reply();
}

bool host_sends(void) {
  return is_sending();
}

bool host_send(const uint8_t* reply, uint8_t* wire, size_t* size) {
  if (!is_sending()) {
    if (TIMSK3 != 0) TIMER3_COMPA_vect();
    *size = 0;
    return false;
  }
  // The chip has 16 bits of an address.
  const uint16_t at = (uint16_t)(LINE_SENDING_LOW | LINE_SENDING_HIGH << 8);
  const uint16_t offset = (uint16_t)(at - (uint16_t)(uintptr_t)reply);
  if (offset >= BUSHD_MCU_MAX_REPLY) abort();
  wire[(*size)++] = reply[offset];
  LINE_SENDING_LOW = (uint8_t)(at + 1u);
  LINE_SENDING_HIGH = (uint8_t)((at + 1u) >> 8);
  if (LINE_SENDING_LOW != line_sending_end) return false;
  DE_PORT &= (uint8_t)~(1 << DE_BIT);
  UCSR0B = 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0;
  return true;
}

bool host_writes(void) {
  return eeprom_writes;
}

void host_end_write(void) {
  eeprom_writes = false;
}
