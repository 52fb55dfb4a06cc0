// An MCU on the virtual bus that is an ATmega2560 or ATmega1284P: its image runs in simavr,
// instruction by instruction, and its pins and bytes are taken with the time of the CPU cycle.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "sim/avr/avr_chip.h"
#include "sim/avr/avr_uart_line.h"
#include "sim/avr/memory_watch.h"
#include "sim/mcu.h"
#include "sim/power_stage.h"

struct avr_t;
struct avr_io_t;
struct avr_irq_t;

namespace bushd::sim {

struct AvrOptions {
  std::string image;         // path of the ELF
  std::uint8_t address = 1;  // in its EEPROM
  std::uint64_t unique_id = 1;
  std::uint16_t boots = 0;  // boot number of the boot before
  // Path of who may write where (memory_watch.h): then the image stops at the first wrong access.
  // "": unwatched, and faster.
  std::string memory_owners = {};
  std::string chip = "atmega2560";  // avr_chip.h
  // Behind the outputs of motor 0; its currents go to the sink. Only of a chip with comparators.
  std::optional<PowerStageRules> power_stage = {};
};

class AvrMcu final : public Mcu {
 public:
  // Throws std::runtime_error if the image cannot be read; and later, whenever time goes on, what
  // the watch found. It boots at time 0.
  AvrMcu(const AvrOptions& options, std::size_t index, Driver& driver, EdgeSink* sink);
  ~AvrMcu() override;

  // What the EEPROM holds.
  std::uint8_t address() const override;
  std::uint16_t boot_number() const override;

  bool running() const override { return now_ns_ >= out_of_reset_ns_; }

  void set_inputs(bushd_inputs inputs) override;
  void set_current(std::uint16_t reading) override;

  TimeNs next_event_ns() const override;
  bool may_speak() const override { return true; }
  void advance(TimeNs now_ns) override;
  void receive(std::uint8_t byte, TimeNs now_ns) override;
  void reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t boot_number) override;

  // What the current sensor reads when a conversion begins; not set: what set_current said.
  std::function<std::uint16_t(TimeNs time_ns)> on_conversion;

  void keypad_byte(std::uint8_t byte, TimeNs now_ns) override;
  // A byte with a framing error from the keypad. Precondition: the chip has such a line.
  void keypad_break(TimeNs now_ns);
  std::string take_keypad_display() override { return std::exchange(display_, {}); }
  // If set, it gets what would be taken: when the stop bit ends, and the byte.
  std::function<void(TimeNs end_ns, std::uint8_t byte)> on_keypad_display;

  // Precondition: it has one.
  const PowerStage& power_stage() const { return stage_->stage; }

  // Faults of the chip.
  void hang();        // jumps into an endless loop, interrupts stay as they are
  void stop_ticks();  // the tick timer's interrupts are off
  void flip_flash_bit(std::uint32_t address, int bit);
  void flip_eeprom_bit(std::uint16_t address, int bit);
  // Whatever is written to it from now on, it holds this.
  void wear_eeprom_byte(std::uint16_t address, std::uint8_t value);
  // If the image is writing one. A write ends there, as if the power went: reset it next.
  void tear_eeprom_byte();
  void poke(std::uint16_t address, std::uint8_t value);  // in RAM
  void stick_ram_bit(std::uint16_t address, int bit);    // at 0; slow
  void short_motor_input(int motor);                     // of 0..7, to the supply

  // Bytes of RAM that nothing has written to since they were tested at boot, between variables and
  // stack.
  std::size_t untouched_ram() const;
  // Entered since power-on.
  std::uint64_t interrupts() const { return interrupts_; }
  // Bytes written to its EEPROM while it ran.
  std::uint64_t eeprom_writes() const { return eeprom_writes_; }
  // Bytes lost in its receiver.
  std::uint64_t overruns() const { return line_->overruns(); }
  // Bytes whose last stop bit was not over when driver-enable fell, or that began without it.
  std::uint64_t bytes_cut() const { return bytes_cut_; }

 private:
  struct Pin {
    AvrMcu* mcu;
    Signal signal;
    std::uint8_t index;
    bool level;
    AvrPin at;  // without a port: behind a shift register
  };

  void watch_port(char port, Signal signal, std::uint8_t first_index);
  void watch_signal(AvrPin pin, Signal signal);
  using Notify = void (*)(avr_irq_t*, std::uint32_t, void*);
  void watch_pin(AvrPin pin, Notify notify, void* param);
  // A member function as what simavr calls.
  template <void (AvrMcu::*kMember)(std::uint32_t value)>
  static void call(avr_irq_t*, std::uint32_t value, void* param) {
    (static_cast<AvrMcu*>(param)->*kMember)(value);
  }
  void set_pin(Pin& pin, bool level);
  void drop_outputs();
  void drive(AvrPin pin, bool level);
  void read_eeprom(std::uint16_t address, std::span<std::uint8_t> bytes) const;
  void write_eeprom(std::uint16_t address, std::span<const std::uint8_t> bytes);
  TimeNs time_ns() const;
  static void on_pin(avr_irq_t* irq, std::uint32_t value, void* param);
  void begin_stage(const PowerStageRules& rules);
  void stage_output(std::uint8_t winding, bool level);
  void follow_stage();
  void on_decay(std::uint32_t level);
  void on_reference(std::uint32_t);
  static std::uint64_t on_stage_time(avr_t* avr, std::uint64_t when, void* param);
  static void on_spi(avr_t* avr, std::uint16_t address, std::uint8_t value, void* param);
  void on_dir_latch(std::uint32_t level);
  void on_driver_enable(std::uint32_t level);
  void on_byte(std::uint64_t end_cycle, std::uint8_t byte);
  void on_adc(std::uint32_t);
  void on_interrupt(std::uint32_t vector);
  static void on_reset(avr_io_t* io);
  static void on_eeprom_control(avr_t* avr, std::uint16_t address, std::uint8_t value, void* param);
  static std::uint8_t read_shorted(avr_t* avr, std::uint16_t address, void* param);

  const AvrChip& chip_;
  std::size_t index_;
  Driver& driver_;
  EdgeSink* sink_;
  avr_t* avr_;
  struct ResetHook;
  std::unique_ptr<ResetHook> reset_hook_;
  std::unique_ptr<AvrMemoryWatch> watch_;
  std::unique_ptr<AvrUartLine> line_;
  std::unique_ptr<AvrUartLine> keypad_;  // if the chip has it
  std::string display_;                  // sent to it and not taken; no more than some lines
  TimeNs cycle_0_ns_ = 0;
  TimeNs now_ns_ = 0;
  TimeNs out_of_reset_ns_ = 0;
  std::size_t stack_begin_ = 0;
  struct Bit {
    std::uint16_t address;
    int bit;
  };
  std::optional<Bit> stuck_;
  std::uint8_t shorted_ = 0;
  std::map<std::uint16_t, std::uint8_t> worn_;  // of the EEPROM
  bool driver_enable_ = false;
  TimeNs byte_end_ns_ = 0;
  std::uint64_t interrupts_ = 0;
  std::uint64_t eeprom_writes_ = 0;
  std::uint64_t bytes_cut_ = 0;
  std::array<Pin, 35> pins_{};
  std::size_t pin_count_ = 0;
  struct Driven {  // of a port, by what is outside
    std::uint8_t mask = 0;
    std::uint8_t levels = 0;
  };
  std::array<Driven, 12> driven_{};
  // Power stage and comparators, with the filter behind the PWM that makes their reference.
  struct Stage {
    PowerStage stage;
    double high_share = 0;  // of the PWM
    TimeNs followed_ns = 0;
    std::array<bool, PowerStage::kPairs> trips{};
    std::array<double, PowerStage::kWindings> told_a{};  // to the sink
  };
  std::optional<Stage> stage_;
  std::size_t first_dir_ = 0;  // of pins_, behind the shift register
  std::uint8_t shifted_ = 0;
};

}  // namespace bushd::sim
