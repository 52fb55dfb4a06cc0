#include "sim/virtual_mcu.h"

#include <algorithm>

#include "firmware/core/nvm.h"
#include "sim/disabled_capabilities.h"

namespace bushd::sim {

VirtualMcu::VirtualMcu(const McuOptions& options, std::size_t index, Driver& driver, EdgeSink* sink)
    : index_(index),
      driver_(driver),
      sink_(sink),
      supply_(options.supply ? std::optional<SupplyCurrent>(*options.supply) : std::nullopt),
      queue_(std::size_t{options.queue_ticks} * options.motors),
      codes_(options.code_count),
      program_bytes_(options.program_bytes) {
  program_.bytes = program_bytes_.data();
  program_.memory = options.program_bytes;
  bushd_virtual_config config{};
  config.mcu.address = options.address;
  config.mcu.motors = options.motors;
  config.mcu.slots = options.slots;
  config.mcu.boot_number = options.boot_number;
  config.mcu.queue = queue_.data();
  config.mcu.queue_ticks = options.queue_ticks;
  config.mcu.codes = codes_.data();
  config.mcu.code_count = options.code_count;
  config.mcu.current_motors = options.current_motors;
  config.mcu.velocity_motors = options.velocity_motors;
  config.mcu.keypad = true;
  config.mcu.scratch = &scratch_;
  config.mcu.program = &program_;
  config.mcu.keeps_programs = options.keeps;
  if (options.keeps) {
    nvm_.resize(BUSHD_MCU_NVM_MAX_BYTES(std::size_t{options.code_count}) +
                BUSHD_MCU_NVM_PROGRAM_BYTES(std::size_t{options.program_bytes}));
    config.nvm = nvm_.data();
    config.nvm_size = nvm_.size();
  }
  disable_capabilities(options.disabled_capabilities, &config.mcu);
  const std::uint64_t unique_id = options.unique_id != 0 ? options.unique_id : index + 1;
  for (std::size_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) {
    config.mcu.unique_id[i] = static_cast<std::uint8_t>(unique_id >> 8 * i);
  }
  config.boot_ns = options.boot_ns;
  config.clock_ppm = options.clock_ppm;
  config.turnaround_ns = options.turnaround_ns;
  config.context = this;
  config.read_inputs = on_read_inputs;
  config.edge = sink != nullptr || supply_ ? on_edge : nullptr;
  config.current = supply_ ? on_current : nullptr;
  config.transmit = on_transmit;
  bushd_virtual_init(&port_, &config);
}

// Active is true.
Edge VirtualMcu::as_drivers_see(const bushd_set_outputs& levels, Edge edge) {
  const bool low = edge.signal == Signal::kStep  ? (levels.step_low >> edge.index & 1) != 0
                   : edge.signal == Signal::kDir ? (levels.direction_low >> edge.index & 1) != 0
                   : edge.signal == Signal::kCommonDir
                       ? (levels.direction_low & 1) != 0
                       : edge.signal == Signal::kEnable && levels.enabled == BUSHD_ENABLED_LOW;
  edge.level = edge.level != low;
  return edge;
}

void VirtualMcu::on_edge(void* context, std::int64_t time_ns, bushd_virtual_signal signal,
                         std::uint8_t index, bool level) {
  auto& self = *static_cast<VirtualMcu*>(context);
  static_assert(static_cast<int>(Signal::kStep) == BUSHD_VIRTUAL_STEP);
  static_assert(static_cast<int>(Signal::kDir) == BUSHD_VIRTUAL_DIR);
  static_assert(static_cast<int>(Signal::kEnable) == BUSHD_VIRTUAL_EN);
  static_assert(static_cast<int>(Signal::kCommonDir) == BUSHD_VIRTUAL_COMMON_DIR);
  static_assert(static_cast<int>(Signal::kPositionCompare) == BUSHD_VIRTUAL_COMPARE);
  const Edge edge = {time_ns, self.index_, static_cast<Signal>(signal), index, level};
  if (self.supply_) self.supply_->edge(as_drivers_see(self.port_.rest, edge));
  if (self.sink_ != nullptr) self.sink_->edge(edge);
}

std::uint16_t VirtualMcu::on_current(void* context, std::int64_t time_ns) {
  auto& self = *static_cast<VirtualMcu*>(context);
  const std::uint16_t reading = std::max(self.supply_->reading(time_ns), self.port_.current);
  if (self.sink_ != nullptr && reading != self.supply_told_) {
    self.supply_told_ = reading;
    self.sink_->sample({time_ns, self.index_, Sample::kSupply, static_cast<double>(reading)});
  }
  return reading;
}

void VirtualMcu::attach_switch(std::size_t output, const SwitchOptions& options) {
  switches_.insert_or_assign(options.input.value_or(static_cast<std::uint8_t>(output)),
                             Wired{output, Switch(options)});
}

bushd_inputs VirtualMcu::on_read_inputs(void* context, std::int64_t time_ns) {
  auto& self = *static_cast<VirtualMcu*>(context);
  bushd_inputs inputs = self.port_.inputs;
  for (auto& [input, wired] : self.switches_) {
    const auto bit = static_cast<std::uint16_t>(1u << input);
    const bool active = wired.contact.read(time_ns, self.port_.shaft[wired.output].position_steps);
    inputs.motors = static_cast<std::uint16_t>(active ? inputs.motors | bit : inputs.motors & ~bit);
  }
  return inputs;
}

std::string VirtualMcu::take_keypad_display() {
  std::string text;
  for (int next = bushd_virtual_keypad_display(&port_); next >= 0;
       next = bushd_virtual_keypad_display(&port_)) {
    text += static_cast<char>(next);
  }
  return text;
}

void VirtualMcu::on_transmit(void* context, std::int64_t start_ns, const std::uint8_t* wire,
                             std::size_t size) {
  const auto& self = *static_cast<VirtualMcu*>(context);
  self.driver_.transmit(self.index_, start_ns, wire, size);
}

}  // namespace bushd::sim
