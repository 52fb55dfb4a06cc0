#include "sim/avr/avr_mcu.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

extern "C" {
#include <avr_adc.h>
#include <avr_eeprom.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <sim_interrupts.h>
#include <sim_io.h>
#include <sim_regbit.h>
}

#include "engine/frame.h"

namespace bushd::sim {
namespace {

constexpr std::uint32_t kFrequency = 16'000'000;
constexpr std::uint8_t kPaint = 0xC5;  // firmware/ports/atmega2560/boot_tests.h
// Behind the one that simavr holds: the chip's buffer has two, its shift register one more.
constexpr std::size_t kHardwareFifo = 2;
constexpr std::size_t kMostDisplay = 256;
// In the address space of data.
constexpr std::size_t kMcusr = 0x54;
constexpr std::size_t kEecr = 0x3F;
constexpr std::size_t kEear = 0x41;
constexpr std::uint16_t kPink = 0x106;
constexpr std::uint16_t kPortk = 0x108;
constexpr std::uint16_t kDdrk = 0x107;
constexpr std::uint32_t kSupplyMv = 5000;
constexpr std::size_t kTimsk1 = 0x6F;
constexpr std::uint8_t kEerie = 1 << 3;
constexpr std::uint8_t kPowerOn = 1;
constexpr std::uint8_t kExternalReset = 2;
constexpr std::uint16_t kJumpToItself = 0xCFFF;
constexpr std::size_t kAddressAt = 8;
constexpr std::size_t kBootNumberAt = 16;

// Busy waiting is all that the image does; the simulator must not sleep for it in real time.
void no_sleep(avr_t*, avr_cycle_count_t) {}

avr_uart_t* find_uart(avr_t* avr) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    if (std::strcmp(io->kind, "uart") != 0) continue;
    auto* uart = reinterpret_cast<avr_uart_t*>(io);
    if (uart->name == '0') return uart;
  }
  throw std::runtime_error("simavr: no UART 0");
}

avr_irq_t* irq_of(avr_t* avr, AvrPin pin) {
  return avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(static_cast<unsigned>(pin.port)), pin.bit);
}

}  // namespace

struct AvrMcu::ResetHook {
  avr_io_t io;  // first: simavr knows it by this
  AvrMcu* mcu;
};

AvrMcu::AvrMcu(const AvrOptions& options, std::size_t index, Driver& driver, EdgeSink* sink)
    : chip_(avr_chip(options.chip)), index_(index), driver_(driver), sink_(sink) {
  log_errors_only();
  elf_firmware_t firmware{};
  if (elf_read_firmware(options.image.c_str(), &firmware) != 0) {
    throw std::runtime_error(options.image + ": not an image for an AVR");
  }
  avr_ = avr_make_mcu_by_name(chip_.name);
  if (avr_ == nullptr) throw std::runtime_error("simavr: no " + options.chip);
  avr_init(avr_);
  mend(avr_, chip_);
  avr_->frequency = firmware.frequency = kFrequency;
  avr_load_firmware(avr_, &firmware);
  avr_->sleep = no_sleep;
  avr_->log = LOG_ERROR;
  avr_->vcc = avr_->avcc = avr_->aref = kSupplyMv;
  // Pins that are low would be looked at in every cycle, for interrupts that the image does not
  // use.
  for (std::uint8_t i = 0; i < chip_.external_interrupts; ++i) {
    avr_extint_set_strict_lvl_trig(avr_, i, 0);
  }
  stack_begin_ = chip_.ram_begin + firmware.datasize + firmware.bsssize;
  avr_->data[kMcusr] = kPowerOn;

  std::array<std::uint8_t, 18> memory{};
  for (std::size_t i = 0; i < kAddressAt; ++i) {
    memory[i] = static_cast<std::uint8_t>(options.unique_id >> 8 * i);
  }
  memory[kAddressAt] = options.address;
  const std::uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, memory.data(), kAddressAt + 1);
  for (std::size_t i = 0; i < 4; ++i) {
    memory[kAddressAt + 1 + i] = static_cast<std::uint8_t>(crc >> 8 * i);
  }
  memory[kBootNumberAt] = static_cast<std::uint8_t>(options.boots);
  memory[kBootNumberAt + 1] = static_cast<std::uint8_t>(options.boots >> 8);
  avr_eeprom_desc_t written{memory.data(), 0, static_cast<std::uint32_t>(memory.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &written);

  uart_ = find_uart(avr_);
  std::uint32_t flags = 0;
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte,
                          this);
  avr_irq_register_notify(avr_get_interrupt_irq(avr_, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
                          on_interrupt, this);
  for (std::size_t half = 0; half < chip_.step.size(); ++half) {
    const auto first = static_cast<std::uint8_t>(8 * half);
    watch_port(chip_.step[half], Signal::kStep, first);
    watch_port(chip_.dir[half], Signal::kDir, first);
  }
  watch_signal(chip_.enable, Signal::kEnable);
  watch_signal(chip_.compare, Signal::kPositionCompare);
  watch_signal(chip_.common_dir, Signal::kCommonDir);
  watch_pin(chip_.driver_enable, on_driver_enable, this);
  if (chip_.spi_data != 0) {
    first_dir_ = pin_count_;
    for (std::uint8_t i = 0; i < 8; ++i) pins_[pin_count_++] = {this, Signal::kDir, i, false, {}};
    avr_register_io_write(avr_, chip_.spi_data, on_spi, this);
    watch_pin(chip_.dir_latch, on_dir_latch, this);
  }
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), on_adc,
                          this);

  if (chip_.keypad_uart != 0) {
    keypad_ = std::make_unique<AvrUartLine>(
        avr_, chip_.keypad_uart, [this](std::uint64_t cycle, std::uint8_t byte) {
          if (on_keypad_display) {
            on_keypad_display(cycle_0_ns_ + static_cast<TimeNs>(cycle) * 125 / 2, byte);
          } else if (display_.size() < kMostDisplay) {
            display_ += static_cast<char>(byte);
          }
        });
  }

  reset_hook_ = std::make_unique<ResetHook>();
  reset_hook_->io.kind = "board";
  reset_hook_->io.reset = on_reset;
  reset_hook_->mcu = this;
  avr_register_io(avr_, &reset_hook_->io);
  if (!options.memory_owners.empty()) {
    watch_ = std::make_unique<AvrMemoryWatch>(avr_, chip_, options.image, options.memory_owners);
  }
  set_inputs({});
  if (options.power_stage) begin_stage(*options.power_stage);
}

AvrMcu::~AvrMcu() {
  watch_.reset();
  avr_terminate(avr_);
  std::free(avr_);
}

void AvrMcu::watch_port(char port, Signal signal, std::uint8_t first_index) {
  if (port == 0) return;
  for (int pin = 0; pin < 8; ++pin) {
    Pin& watched = pins_[pin_count_++];
    watched = {this, signal, static_cast<std::uint8_t>(first_index + pin), false, {port, pin}};
    watch_pin(watched.at, on_pin, &watched);
  }
}

void AvrMcu::watch_signal(AvrPin pin, Signal signal) {
  if (pin.port == 0) return;
  pins_[pin_count_] = {this, signal, 0, false, pin};
  watch_pin(pin, on_pin, &pins_[pin_count_++]);
}

void AvrMcu::watch_pin(AvrPin pin, void (*notify)(avr_irq_t*, std::uint32_t, void*), void* param) {
  avr_irq_t* irq = irq_of(avr_, pin);
  if (irq == nullptr) throw std::runtime_error("simavr: a pin is missing");
  avr_irq_register_notify(irq, notify, param);
}

// Whenever a port is written to, simavr gives its inputs the level of their pull-ups, but where it
// knows what drives them.
void AvrMcu::drive(AvrPin pin, bool level) {
  if (pin.port == 0) return;
  Driven& port = driven_[static_cast<std::size_t>(pin.port - 'A')];
  const auto bit = static_cast<std::uint8_t>(1 << pin.bit);
  port.mask |= bit;
  port.levels = static_cast<std::uint8_t>(level ? port.levels | bit : port.levels & ~bit);
  avr_ioport_external_t external{};
  external.name = static_cast<unsigned>(pin.port) & 0x7Fu;
  external.mask = port.mask;
  external.value = port.levels;
  avr_ioctl(avr_, AVR_IOCTL_IOPORT_SET_EXTERNAL(static_cast<unsigned>(pin.port)), &external);
  avr_raise_irq(
      avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(static_cast<unsigned>(pin.port)), pin.bit),
      level);
}

// Switches to ground.
void AvrMcu::set_inputs(bushd_inputs inputs) {
  for (std::size_t i = 0; i < chip_.inputs.size(); ++i) {
    drive(chip_.inputs[i], (inputs.motors >> i & 1) == 0);
  }
  drive(chip_.trigger, (inputs.system & BUSHD_INPUT_TRIGGER) == 0);
  drive(chip_.emergency, (inputs.system & BUSHD_INPUT_EMERGENCY) == 0);
  drive(chip_.forward, (inputs.system & BUSHD_INPUT_FORWARD) == 0);
  drive(chip_.reverse, (inputs.system & BUSHD_INPUT_REVERSE) == 0);
}

void AvrMcu::set_current(std::uint16_t reading) {
  // Rounded up: the converter rounds down.
  const std::uint32_t mv = (reading * kSupplyMv + BUSHD_MAX_CURRENT - 1) / BUSHD_MAX_CURRENT;
  avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), mv);
}

void AvrMcu::on_adc(avr_irq_t*, std::uint32_t, void* param) {
  auto& self = *static_cast<AvrMcu*>(param);
  if (self.on_conversion) self.set_current(self.on_conversion(self.time_ns()));
}

TimeNs AvrMcu::time_ns() const {
  return cycle_0_ns_ + static_cast<TimeNs>(avr_->cycle) * 125 / 2;
}

// An edge calls twice, with other bits above the level.
void AvrMcu::on_pin(avr_irq_t*, std::uint32_t value, void* param) {
  auto& pin = *static_cast<Pin*>(param);
  pin.mcu->set_pin(pin, (value & 1) != 0);
}

void AvrMcu::set_pin(Pin& pin, bool level) {
  if (level == pin.level) return;
  pin.level = level;
  if (stage_ && pin.signal == Signal::kStep && pin.index < PowerStage::kWindings) {
    stage_output(pin.index, level);
  }
  if (sink_ != nullptr) sink_->edge({time_ns(), index_, pin.signal, pin.index, level});
}

// simavr takes 100 us for a byte whatever its rate: it is taken when it is written, and latched
// later.
void AvrMcu::on_spi(avr_t* avr, std::uint16_t address, std::uint8_t value, void* param) {
  avr->data[address] = value;
  static_cast<AvrMcu*>(param)->shifted_ = value;
}

void AvrMcu::on_dir_latch(avr_irq_t*, std::uint32_t value, void* param) {
  auto& self = *static_cast<AvrMcu*>(param);
  if ((value & 1) == 0) return;
  for (std::size_t i = 0; i < 8; ++i) {
    self.set_pin(self.pins_[self.first_dir_ + i], (self.shifted_ >> i & 1) != 0);
  }
}

void AvrMcu::on_driver_enable(avr_irq_t*, std::uint32_t value, void* param) {
  AvrMcu& self = *static_cast<AvrMcu*>(param);
  self.driver_enable_ = (value & 1) != 0;
  if (!self.driver_enable_ && self.time_ns() < self.byte_end_ns_) ++self.bytes_cut_;
}

void AvrMcu::on_byte(avr_irq_t*, std::uint32_t value, void* param) {
  AvrMcu& self = *static_cast<AvrMcu*>(param);
  const auto byte = static_cast<std::uint8_t>(value);
  const TimeNs byte_ns = static_cast<TimeNs>(self.byte_cycles_) * 125 / 2;
  // The chip takes the next byte while the last one is being sent, so that they follow each other
  // closely. simavr asks for it at the end of that one, but counts from there all the same.
  const TimeNs now_ns = self.time_ns();
  const bool joined = now_ns < self.byte_end_ns_ + byte_ns;
  self.byte_end_ns_ = (joined ? self.byte_end_ns_ : now_ns) + byte_ns;
  if (self.driver_enable_) {
    self.driver_.transmit(self.index_, now_ns, &byte, 1);
  } else {
    ++self.bytes_cut_;
  }
}

// By the watchdog too.
void AvrMcu::on_reset(avr_io_t* io) {
  AvrMcu& self = *reinterpret_cast<ResetHook*>(io)->mcu;
  if (self.watch_) self.watch_->reset();
  self.drop_outputs();
  if (self.stage_) avr_cycle_timer_register(self.avr_, 1, on_stage_time, &self);
}

void AvrMcu::drop_outputs() {
  driver_enable_ = false;
  received_.clear();
  if (keypad_) keypad_->reset();
  for (std::size_t i = 0; i < pin_count_; ++i) {
    Pin& pin = pins_[i];
    set_pin(pin, false);
    // simavr would not tell of a pin that has after the reset the level that it had before.
    if (pin.at.port != 0) irq_of(avr_, pin.at)->value = 0;
  }
}

// Its vector, or 0 at the end of the last one.
void AvrMcu::on_interrupt(avr_irq_t*, std::uint32_t value, void* param) {
  auto& self = *static_cast<AvrMcu*>(param);
  if (value != 0) ++self.interrupts_;
  if (value == self.chip_.eeprom_ready) ++self.eeprom_writes_;
}

std::array<std::uint8_t, 18> AvrMcu::eeprom() const {
  std::array<std::uint8_t, 18> memory{};
  avr_eeprom_desc_t read{memory.data(), 0, static_cast<std::uint32_t>(memory.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &read);
  return memory;
}

std::uint8_t AvrMcu::address() const {
  return eeprom()[kAddressAt];
}

std::uint16_t AvrMcu::boot_number() const {
  const auto memory = eeprom();
  return static_cast<std::uint16_t>(memory[kBootNumberAt] | memory[kBootNumberAt + 1] << 8);
}

TimeNs AvrMcu::next_event_ns() const {
  return time_ns();
}

void AvrMcu::advance(TimeNs now_ns) {
  now_ns_ = now_ns;
  while (time_ns() < now_ns) {
    if (uart_->cycles_per_byte != byte_cycles_) {
      byte_cycles_ = uart_->cycles_per_byte = uart_->cycles_per_byte * 10 / 11;
    }
    feed();
    if (keypad_) keypad_->step();
    auto left = static_cast<avr_cycle_count_t>((now_ns - time_ns()) * 2 / 125 + 1);
    if (stuck_) {
      left = 1;
      avr_->data[stuck_->address] &= static_cast<std::uint8_t>(~(1 << stuck_->bit));
    }
    avr_->run_cycle_limit = left;
    avr_->run_cycle_count = std::min(avr_->run_cycle_count, left);
    if (avr_run(avr_) == cpu_Crashed) {
      const bool seen = watch_ && watch_->violation();
      throw std::runtime_error(seen ? *watch_->violation() : "simavr: the image has crashed");
    }
    // After RETI and SEI the chip executes one instruction before it serves an interrupt (data
    // sheet, reset and interrupt handling); simavr would two.
    if (avr_->interrupt_state == -1) {
      avr_->interrupt_state = avr_has_pending_interrupts(avr_) != 0 ? 1 : 0;
    }
  }
}

void AvrMcu::receive(std::uint8_t byte, TimeNs now_ns) {
  advance(now_ns);
  if (avr_regbit_get(avr_, uart_->rxen) == 0) return;
  if (received_.size() == kHardwareFifo) {
    ++overruns_;
    return;
  }
  received_.push_back(byte);
  feed();
}

void AvrMcu::keypad_byte(std::uint8_t byte, TimeNs now_ns) {
  advance(now_ns);
  if (keypad_) keypad_->receive(byte);
}

void AvrMcu::keypad_break(TimeNs now_ns) {
  advance(now_ns);
  keypad_->receive_break();
}

// simavr forgets the interrupt of a byte that waits behind another one: it gets one at a time.
void AvrMcu::feed() {
  uart_fifo_t& fifo = uart_->input;
  if (received_.empty() || fifo.read != fifo.write) return;
  fifo.buffer[fifo.write] = received_.front();
  fifo.write = static_cast<std::uint16_t>((fifo.write + 1) % uart_fifo_fifo_size);
  received_.pop_front();
  avr_raise_interrupt(avr_, &uart_->rxc);
}

void AvrMcu::reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t) {
  advance(now_ns);
  avr_reset(avr_);
  avr_->data[kMcusr] = kExternalReset;
  out_of_reset_ns_ = boot_ns;
  cycle_0_ns_ = boot_ns - static_cast<TimeNs>(avr_->cycle) * 125 / 2;
}

void AvrMcu::hang() {
  const auto* const flash = reinterpret_cast<const std::uint16_t*>(avr_->flash);
  const auto* const end = flash + (avr_->flashend + 1) / 2;
  const auto* const loop = std::find(flash, end, kJumpToItself);
  if (loop == end) throw std::runtime_error("the image has no endless loop");
  avr_->pc = static_cast<avr_flashaddr_t>((loop - flash) * 2);
}

void AvrMcu::stop_ticks() {
  avr_->data[kTimsk1] = 0;
}

void AvrMcu::flip_flash_bit(std::uint32_t address, int bit) {
  avr_->flash[address] ^= static_cast<std::uint8_t>(1 << bit);
}

void AvrMcu::flip_eeprom_bit(std::uint16_t address, int bit) {
  std::uint8_t byte = 0;
  avr_eeprom_desc_t at{&byte, address, 1};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &at);
  byte ^= static_cast<std::uint8_t>(1 << bit);
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &at);
}

void AvrMcu::wear_eeprom_byte(std::uint16_t address, std::uint8_t value) {
  if (worn_.empty()) avr_register_io_write(avr_, kEecr, on_eeprom_control, this);
  worn_[address] = value;
  on_eeprom_control(avr_, kEecr, 0, this);
}

// simavr has written what it was to.
void AvrMcu::on_eeprom_control(avr_t* avr, std::uint16_t, std::uint8_t, void* param) {
  for (auto [address, value] : static_cast<AvrMcu*>(param)->worn_) {
    avr_eeprom_desc_t at{&value, address, 1};
    avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &at);
  }
}

void AvrMcu::tear_eeprom_byte() {
  if ((avr_->data[kEecr] & kEerie) == 0) return;
  const auto address = static_cast<std::uint16_t>(avr_->data[kEear] | avr_->data[kEear + 1] << 8);
  flip_eeprom_bit(address, 0);
  flip_eeprom_bit(address, 6);
}

void AvrMcu::poke(std::uint16_t address, std::uint8_t value) {
  avr_->data[address] = value;
}

void AvrMcu::stick_ram_bit(std::uint16_t address, int bit) {
  stuck_ = Bit{address, bit};
}

void AvrMcu::short_motor_input(int motor) {
  shorted_ = static_cast<std::uint8_t>(shorted_ | 1 << motor);
  auto& read = avr_->io[AVR_DATA_TO_IO(kPink)].r;
  read.c = read_shorted;
  read.param = this;
}

std::uint8_t AvrMcu::read_shorted(avr_t* avr, std::uint16_t address, void* param) {
  const std::uint8_t* const data = avr->data;
  const int pins = (data[address] & ~data[kDdrk]) | (data[kPortk] & data[kDdrk]);
  return static_cast<std::uint8_t>(pins | static_cast<AvrMcu*>(param)->shorted_);
}

std::size_t AvrMcu::untouched_ram() const {
  std::size_t at = stack_begin_;
  while (at <= avr_->ramend && avr_->data[at] == kPaint) ++at;
  return at - stack_begin_;
}

}  // namespace bushd::sim
