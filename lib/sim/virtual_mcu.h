// One MCU on the virtual bus: the real firmware core on the virtual port, with its memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "firmware/ports/virtual/virtual.h"
#include "sim/mcu.h"
#include "sim/supply_current.h"
#include "sim/switch.h"

namespace bushd::sim {

// What is typical for a 32-bit MCU of today; all of it is told to the host in its identity.
struct McuOptions {
  std::uint8_t address = 1;  // 1..255
  std::uint8_t motors = BUSHD_MOTORS_PER_MCU;
  std::uint16_t slots = BUSHD_MAX_SLOTS;
  std::uint16_t boot_number = 1;
  std::uint16_t queue_ticks = 1024;  // a power of two
  std::uint16_t code_count = 16384;
  std::uint16_t program_bytes = 8192;
  bool keeps = false;  // tables, settings and programs over resets, as a port with flash does
  std::uint32_t disabled_capabilities = 0;  // BUSHD_CAN_*: it has all others
  // How many motors it controls the currents of, and how many may move by the velocity loop; >= 1:
  // an MCU without these capabilities has them disabled.
  std::uint8_t current_motors = BUSHD_MAX_CURRENT_MOTORS;
  std::uint8_t velocity_motors = BUSHD_MAX_VELOCITY_MOTORS;
  TimeNs boot_ns =
      0;  // out of reset here: until then deaf. Its ticks begin here too, so this is their phase.
  std::int32_t clock_ppm = 0;  // > 0: its clock is fast
  std::uint32_t turnaround_ns = 20'000;
  std::uint64_t unique_id = 0;  // 0: made of its place on the bus
  // What its current sensor sees; set_current says what it reads at least. Without it, what it
  // reads.
  std::optional<SupplyRules> supply{};
};

class VirtualMcu final : public Mcu {
 public:
  // `index` stands in its edges and transmissions. `sink` may be null; both outlive the MCU.
  VirtualMcu(const McuOptions& options, std::size_t index, Driver& driver, EdgeSink* sink);

  std::uint8_t address() const override { return port_.config.mcu.address; }
  std::uint16_t boot_number() const override { return port_.config.mcu.boot_number; }
  bool running() const override { return port_.running; }  // out of reset
  TimeNs next_event_ns() const override { return bushd_virtual_next_event_ns(&port_); }

  // Not valid before the first boot.
  const bushd_mcu& core() const { return port_.mcu; }

  // What the motor on this output has done, whatever the MCU believes: it outlives reboots. Until
  // the start of the present tick.
  const bushd_virtual_shaft& shaft(std::size_t output) const { return port_.shaft[output]; }
  // When the present tick began. A step in its first slot is made at just this time.
  TimeNs tick_start_ns() const { return port_.tick_start_ns; }

  void set_inputs(bushd_inputs inputs) override { bushd_virtual_set_inputs(&port_, inputs); }
  // From now on that input is what a switch at the shaft of this output's motor says.
  void attach_switch(std::size_t output, const SwitchOptions& options);
  void set_current(std::uint16_t reading) override { port_.current = reading; }
  void fail_self_tests(std::uint8_t tests) { port_.failing_tests = tests; }     // of the next boots
  void set_reset_cause(bushd_reset_cause cause) { port_.reset_cause = cause; }  // of the next boot

  // Precondition: it has one.
  const SupplyCurrent& supply() const { return *supply_; }

  // See firmware/ports/virtual/virtual.h.
  void advance(TimeNs now_ns) override { bushd_virtual_advance(&port_, now_ns); }
  void receive(std::uint8_t byte, TimeNs now_ns) override {
    bushd_virtual_receive(&port_, byte, now_ns);
  }
  void keypad_byte(std::uint8_t byte, TimeNs now_ns) override {
    bushd_virtual_keypad_byte(&port_, byte, now_ns);
  }
  void keypad_break(TimeNs now_ns) { bushd_virtual_keypad_break(&port_, now_ns); }
  // At once, without the time of a line.
  std::string take_keypad_display() override;
  void reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t boot_number) override {
    bushd_virtual_reset(&port_, now_ns, boot_ns, boot_number);
  }

 private:
  static Edge as_drivers_see(const bushd_set_outputs& levels, Edge edge);
  static void on_edge(void* context, std::int64_t time_ns, bushd_virtual_signal signal,
                      std::uint8_t index, bool level);
  static bushd_inputs on_read_inputs(void* context, std::int64_t time_ns);
  static std::uint16_t on_current(void* context, std::int64_t time_ns);
  static void on_transmit(void* context, std::int64_t start_ns, const std::uint8_t* wire,
                          std::size_t size);

  std::size_t index_;
  Driver& driver_;
  EdgeSink* sink_;
  std::optional<SupplyCurrent> supply_;
  std::uint16_t supply_told_ = 0;  // to the sink
  std::vector<std::int16_t> queue_;
  std::vector<std::uint16_t> codes_;
  bushd_mcu_scratch scratch_{};
  std::vector<std::uint8_t> program_bytes_;
  std::vector<std::uint8_t> nvm_;
  bushd_mcu_program program_{};
  struct Wired {
    std::size_t output;
    Switch contact;
  };
  std::map<std::size_t, Wired> switches_;  // by input
  bushd_virtual port_;
};

}  // namespace bushd::sim
