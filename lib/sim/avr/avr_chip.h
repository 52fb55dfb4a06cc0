// What differs between the chips whose images run in simavr: memory, and which pin is what
// (firmware/ports/CHIP/board.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

struct avr_t;

namespace bushd::sim {

struct AvrPin {
  char port = 0;  // 0: there is none
  int bit = 0;
};

struct AvrChip {
  const char* name;
  std::uint16_t ram_begin;
  std::uint8_t return_bytes;  // of an address on the stack
  std::uint8_t external_interrupts;
  std::uint32_t eeprom_ready;  // vector
  std::array<char, 2> step;    // ports of eight; 0: none
  std::array<char, 2> dir;     // 0: none, or through shift registers at the SPI
  AvrPin enable;
  AvrPin compare;
  AvrPin common_dir;
  AvrPin driver_enable;
  std::array<AvrPin, 16> inputs;
  AvrPin trigger;
  AvrPin emergency;
  AvrPin forward;
  AvrPin reverse;
  // Data register of the SPI, in the address space of data, and who latches DIR; 0: DIR is at
  // ports.
  std::uint16_t spi_data;
  AvrPin dir_latch;
  char keypad_uart;  // 0: none
};

// Throws std::runtime_error for another one than "atmega2560" and "atmega1284p".
const AvrChip& avr_chip(const std::string& name);

// simavr writes errors only, to stderr.
void log_errors_only();

// What simavr has otherwise than the data sheet of this chip.
void mend(avr_t* avr, const AvrChip& chip);

}  // namespace bushd::sim
