#include "sim/avr/avr_chip.h"

extern "C" {
#include <avr_adc.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_interrupts.h>
#include <sim_io.h>
}

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace bushd::sim {
namespace {

constexpr std::uint32_t kHz = 16'000'000;
constexpr std::uint8_t kPowerOn = 1;
constexpr std::uint16_t kJumpToItself = 0xCFFF;

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

// Busy waiting is all that an image does; the simulator must not sleep for it in real time.
void no_sleep(avr_t*, avr_cycle_count_t) {}

}  // namespace

LoadedAvr load_avr(const std::string& image, const std::string& chip) {
  avr_global_logger_set(print_errors);
  elf_firmware_t firmware{};
  if (elf_read_firmware(image.c_str(), &firmware) != 0) {
    throw std::runtime_error(image + ": not an image for an AVR");
  }
  avr_t* const avr = avr_make_mcu_by_name(chip.c_str());
  if (avr == nullptr) throw std::runtime_error("simavr: no " + chip);
  avr_init(avr);
  avr->frequency = firmware.frequency = kHz;
  avr_load_firmware(avr, &firmware);
  avr->sleep = no_sleep;
  avr->log = LOG_ERROR;
  avr->data[kAvrMcusr] = kPowerOn;
  return {avr, std::size_t{firmware.datasize} + firmware.bsssize};
}

void free_avr(avr_t* avr) {
  avr_terminate(avr);
  std::free(avr);
}

void jump_into_endless_loop(avr_t* avr) {
  const auto* const flash = reinterpret_cast<const std::uint16_t*>(avr->flash);
  const auto* const end = flash + (avr->flashend + 1) / 2;
  const auto* const loop = std::find(flash, end, kJumpToItself);
  if (loop == end) throw std::runtime_error("the image has no endless loop");
  avr->pc = static_cast<avr_flashaddr_t>((loop - flash) * 2);
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
