// What differs between the chips whose images run in simavr: memory, and which pin is what
// (firmware/ports/CHIP/board.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "sim/edge.h"

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

// Cause of the reset, in the address space of data, of all of them.
constexpr std::size_t kAvrMcusr = 0x54;

// All run at 16 MHz.
constexpr TimeNs ns_of_cycles(std::uint64_t cycles) {
  return static_cast<TimeNs>(cycles) * 125 / 2;
}
// Rounded up.
constexpr std::uint64_t cycles_of_ns(TimeNs ns) {
  return static_cast<std::uint64_t>((ns * 2 + 124) / 125);
}

struct LoadedAvr {
  avr_t* avr;
  std::size_t variables_bytes;
};
// A chip of this name whose supply has just come, with the image in its flash. simavr writes errors
// only, to stderr, and does not sleep. Throws std::runtime_error if the image cannot be read.
LoadedAvr load_avr(const std::string& image, const std::string& chip);
void free_avr(avr_t* avr);

// What simavr has otherwise than the data sheet of this chip.
void mend(avr_t* avr, const AvrChip& chip);

// Jumps into an endless loop; interrupts stay as they are. Throws std::runtime_error if the image
// has none.
void jump_into_endless_loop(avr_t* avr);

}  // namespace bushd::sim
