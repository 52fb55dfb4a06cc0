#include "sim/avr/avr_chip.h"

#include <stdexcept>

namespace bushd::sim {
namespace {

constexpr AvrChip kAtmega2560{.name = "atmega2560",
                              .ram_begin = 0x200,
                              .return_bytes = 3,
                              .external_interrupts = 8,
                              .eeprom_ready = 30,
                              .step = {'A', 'C'},
                              .dir = {'L', 'B'},
                              .enable = {'H', 3},
                              .compare = {'G', 5},
                              .common_dir = {'F', 2},
                              .driver_enable = {'E', 4},
                              .inputs = {{{'K', 0},
                                          {'K', 1},
                                          {'K', 2},
                                          {'K', 3},
                                          {'K', 4},
                                          {'K', 5},
                                          {'K', 6},
                                          {'K', 7},
                                          {'J', 0},
                                          {'J', 1},
                                          {'J', 2},
                                          {'J', 3},
                                          {'J', 4},
                                          {'J', 5},
                                          {'J', 6},
                                          {'J', 7}}},
                              .trigger = {'D', 0},
                              .emergency = {'D', 1},
                              .forward = {'D', 2},
                              .reverse = {'D', 3},
                              .spi_data = 0,
                              .dir_latch = {},
                              .keypad_uart = '2'};

constexpr AvrChip kAtmega1284p{
    .name = "atmega1284p",
    .ram_begin = 0x100,
    .return_bytes = 2,
    .external_interrupts = 3,
    .eeprom_ready = 25,
    .step = {'C', 0},
    .dir = {0, 0},
    .enable = {'D', 5},
    .compare = {'D', 6},
    .common_dir = {},
    .driver_enable = {'D', 4},
    .inputs = {{{'B', 0}, {'A', 1}, {'A', 2}, {'A', 3}, {'A', 4}, {'A', 5}, {'A', 6}}},
    .trigger = {'B', 2},
    .emergency = {'B', 1},
    .forward = {'B', 3},
    .reverse = {'B', 6},
    .spi_data = 0x4E,
    .dir_latch = {'B', 4},
    .keypad_uart = 0};

}  // namespace

const AvrChip& avr_chip(const std::string& name) {
  for (const AvrChip* chip : {&kAtmega2560, &kAtmega1284p}) {
    if (name == chip->name) return *chip;
  }
  throw std::runtime_error(name + ": no chip whose pins are known");
}

}  // namespace bushd::sim
