#include "sim/avr/avr_chip.h"

extern "C" {
#include <avr_adc.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <sim_avr.h>
#include <sim_interrupts.h>
#include <sim_io.h>
}

#include <cstdarg>
#include <cstdio>
#include <cstring>
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

// INT2 of the ATmega1284P is at PB2, and its ADC may run freely; simavr has it at PB3, and knows
// nothing else that would start a conversion.
void mend_atmega1284p(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "adc") == 0) {
      reinterpret_cast<avr_adc_t*>(io)->adts_op[0] = avr_adts_free_running;
    }
    if (std::strcmp(io->kind, "extint") != 0) continue;
    auto& int2 = reinterpret_cast<avr_extint_t*>(io)->eint[EXTINT_IRQ_OUT_INT2];
    avr_irq_t* const interrupt = io->irq + EXTINT_IRQ_OUT_INT2;
    avr_unconnect_irq(avr_io_getirq(avr, int2.port_ioctl, int2.port_pin), interrupt);
    int2.port_pin = 2;
    avr_connect_irq(avr_io_getirq(avr, int2.port_ioctl, int2.port_pin), interrupt);
  }
}

// A flag of an external interrupt is cleared by a one that is written to it (data sheets, "External
// Interrupt Flag Register"); to simavr that is memory, and the interrupt comes nevertheless.
void clear_flags(avr_t* avr, avr_io_addr_t address, std::uint8_t value, void* param) {
  for (auto& external : static_cast<avr_extint_t*>(param)->eint) {
    const avr_regbit_t flag = external.vector.raised;
    if (flag.reg == address && (value >> flag.bit & 1) != 0) {
      avr_clear_interrupt(avr, &external.vector);
    }
  }
}

void mend_external_flags(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "extint") != 0) continue;
    auto* const external = reinterpret_cast<avr_extint_t*>(io);
    avr_register_io_write(avr, external->eint[0].vector.raised.reg, clear_flags, external);
  }
}

// What is written to stdout belongs to the program.
void print_errors(avr_t*, const int level, const char* format, va_list arguments) {
  if (level <= LOG_ERROR) std::vfprintf(stderr, format, arguments);
}

}  // namespace

void log_errors_only() {
  avr_global_logger_set(print_errors);
}

void mend(avr_t* avr, const AvrChip& chip) {
  mend_external_flags(avr);
  if (&chip == &kAtmega1284p) mend_atmega1284p(avr);
}

const AvrChip& avr_chip(const std::string& name) {
  for (const AvrChip* chip : {&kAtmega2560, &kAtmega1284p}) {
    if (name == chip->name) return *chip;
  }
  throw std::runtime_error(name + ": no chip whose pins are known");
}

}  // namespace bushd::sim
