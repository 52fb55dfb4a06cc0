#include "sim/avr/avr_mcu.h"

#include <algorithm>
#include <stdexcept>

extern "C" {
#include <avr_adc.h>
#include <avr_eeprom.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <sim_avr.h>
#include <sim_interrupts.h>
#include <sim_io.h>
}

#include "engine/frame.h"

namespace bushd::sim {
namespace {

constexpr std::uint8_t kPaint = 0xC5;  // firmware/ports/atmega2560/boot_tests.h
constexpr std::size_t kMostDisplay = 256;
// In the address space of data.
constexpr std::size_t kEecr = 0x3F;
constexpr std::size_t kEear = 0x41;
constexpr std::uint16_t kPink = 0x106;
constexpr std::uint16_t kPortk = 0x108;
constexpr std::uint16_t kDdrk = 0x107;
constexpr std::uint32_t kSupplyMv = 5000;
constexpr std::size_t kTimsk1 = 0x6F;
constexpr std::uint8_t kEerie = 1 << 3;
constexpr std::uint8_t kExternalReset = 2;
constexpr std::size_t kAddressAt = 8;
constexpr std::size_t kBootNumberAt = 16;

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
  const LoadedAvr loaded = load_avr(options.image, options.chip);
  avr_ = loaded.avr;
  mend(avr_, chip_);
  avr_->vcc = avr_->avcc = avr_->aref = kSupplyMv;
  // Pins that are low would be looked at in every cycle, for interrupts that the image does not
  // use.
  for (std::uint8_t i = 0; i < chip_.external_interrupts; ++i) {
    avr_extint_set_strict_lvl_trig(avr_, i, 0);
  }
  stack_begin_ = chip_.ram_begin + loaded.variables_bytes;

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
  write_eeprom(0, memory);

  line_ = std::make_unique<AvrUartLine>(
      avr_, '0', [this](std::uint64_t end_cycle, std::uint8_t byte) { on_byte(end_cycle, byte); });
  avr_irq_register_notify(avr_get_interrupt_irq(avr_, AVR_INT_ANY) + AVR_INT_IRQ_RUNNING,
                          call<&AvrMcu::on_interrupt>, this);
  for (std::size_t half = 0; half < chip_.step.size(); ++half) {
    const auto first = static_cast<std::uint8_t>(8 * half);
    watch_port(chip_.step[half], Signal::kStep, first);
    watch_port(chip_.dir[half], Signal::kDir, first);
  }
  watch_signal(chip_.enable, Signal::kEnable);
  watch_signal(chip_.compare, Signal::kPositionCompare);
  watch_signal(chip_.common_dir, Signal::kCommonDir);
  watch_pin(chip_.driver_enable, call<&AvrMcu::on_driver_enable>, this);
  if (chip_.spi_data != 0) {
    first_dir_ = pin_count_;
    for (std::uint8_t i = 0; i < 8; ++i) pins_[pin_count_++] = {this, Signal::kDir, i, false, {}};
    avr_register_io_write(avr_, chip_.spi_data, on_spi, this);
    watch_pin(chip_.dir_latch, call<&AvrMcu::on_dir_latch>, this);
  }
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER),
                          call<&AvrMcu::on_adc>, this);

  if (chip_.keypad_uart != 0) {
    keypad_ = std::make_unique<AvrUartLine>(
        avr_, chip_.keypad_uart, [this](std::uint64_t cycle, std::uint8_t byte) {
          if (on_keypad_display) {
            on_keypad_display(cycle_0_ns_ + ns_of_cycles(cycle), byte);
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
  free_avr(avr_);
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

void AvrMcu::watch_pin(AvrPin pin, Notify notify, void* param) {
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
  avr_raise_irq(irq_of(avr_, pin), level);
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

void AvrMcu::on_adc(std::uint32_t) {
  if (on_conversion) set_current(on_conversion(time_ns()));
}

TimeNs AvrMcu::time_ns() const {
  return cycle_0_ns_ + ns_of_cycles(avr_->cycle);
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

void AvrMcu::on_dir_latch(std::uint32_t level) {
  if ((level & 1) == 0) return;
  for (std::size_t i = 0; i < 8; ++i) {
    set_pin(pins_[first_dir_ + i], (shifted_ >> i & 1) != 0);
  }
}

void AvrMcu::on_driver_enable(std::uint32_t level) {
  driver_enable_ = (level & 1) != 0;
  if (!driver_enable_ && time_ns() < byte_end_ns_) ++bytes_cut_;
}

void AvrMcu::on_byte(std::uint64_t end_cycle, std::uint8_t byte) {
  const TimeNs byte_ns = ns_of_cycles(end_cycle - avr_->cycle);
  // The chip takes the next byte while the last one is being sent, so that they follow each other
  // closely. simavr asks for it at the end of that one, but counts from there all the same.
  const TimeNs now_ns = time_ns();
  const bool joined = now_ns < byte_end_ns_ + byte_ns;
  byte_end_ns_ = (joined ? byte_end_ns_ : now_ns) + byte_ns;
  if (driver_enable_) {
    driver_.transmit(index_, now_ns, &byte, 1);
  } else {
    ++bytes_cut_;
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
  line_->reset();
  if (keypad_) keypad_->reset();
  for (std::size_t i = 0; i < pin_count_; ++i) {
    Pin& pin = pins_[i];
    set_pin(pin, false);
    // simavr would not tell of a pin that has after the reset the level that it had before.
    if (pin.at.port != 0) irq_of(avr_, pin.at)->value = 0;
  }
}

// 0: at the end of the last one.
void AvrMcu::on_interrupt(std::uint32_t vector) {
  if (vector != 0) ++interrupts_;
  if (vector == chip_.eeprom_ready) ++eeprom_writes_;
}

void AvrMcu::read_eeprom(std::uint16_t address, std::span<std::uint8_t> bytes) const {
  avr_eeprom_desc_t read{bytes.data(), address, static_cast<std::uint32_t>(bytes.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &read);
}

void AvrMcu::write_eeprom(std::uint16_t address, std::span<const std::uint8_t> bytes) {
  avr_eeprom_desc_t written{const_cast<std::uint8_t*>(bytes.data()), address,
                            static_cast<std::uint32_t>(bytes.size())};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &written);
}

std::uint8_t AvrMcu::address() const {
  std::array<std::uint8_t, 1> byte{};
  read_eeprom(kAddressAt, byte);
  return byte[0];
}

std::uint16_t AvrMcu::boot_number() const {
  std::array<std::uint8_t, 2> bytes{};
  read_eeprom(kBootNumberAt, bytes);
  return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
}

TimeNs AvrMcu::next_event_ns() const {
  return time_ns();
}

void AvrMcu::advance(TimeNs now_ns) {
  now_ns_ = now_ns;
  while (time_ns() < now_ns) {
    line_->step();
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
  line_->receive(byte);
}

void AvrMcu::keypad_byte(std::uint8_t byte, TimeNs now_ns) {
  advance(now_ns);
  if (keypad_) keypad_->receive(byte);
}

void AvrMcu::keypad_break(TimeNs now_ns) {
  advance(now_ns);
  keypad_->receive_break();
}

void AvrMcu::reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t) {
  advance(now_ns);
  avr_reset(avr_);
  avr_->data[kAvrMcusr] = kExternalReset;
  out_of_reset_ns_ = boot_ns;
  cycle_0_ns_ = boot_ns - ns_of_cycles(avr_->cycle);
}

void AvrMcu::hang() {
  jump_into_endless_loop(avr_);
}

void AvrMcu::stop_ticks() {
  avr_->data[kTimsk1] = 0;
}

void AvrMcu::flip_flash_bit(std::uint32_t address, int bit) {
  avr_->flash[address] ^= static_cast<std::uint8_t>(1 << bit);
}

void AvrMcu::flip_eeprom_bit(std::uint16_t address, int bit) {
  std::array<std::uint8_t, 1> byte{};
  read_eeprom(address, byte);
  byte[0] ^= static_cast<std::uint8_t>(1 << bit);
  write_eeprom(address, byte);
}

void AvrMcu::wear_eeprom_byte(std::uint16_t address, std::uint8_t value) {
  if (worn_.empty()) avr_register_io_write(avr_, kEecr, on_eeprom_control, this);
  worn_[address] = value;
  on_eeprom_control(avr_, kEecr, 0, this);
}

// simavr has written what it was to.
void AvrMcu::on_eeprom_control(avr_t*, std::uint16_t, std::uint8_t, void* param) {
  auto& self = *static_cast<AvrMcu*>(param);
  for (const auto& [address, value] : self.worn_) self.write_eeprom(address, {&value, 1});
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
