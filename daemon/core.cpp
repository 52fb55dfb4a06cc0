#include "daemon/core.h"

#include <algorithm>

#include "daemon/bus.h"

namespace bushd::daemon {

motion::Axis* Core::Bus::moving_axis(link::McuIndex mcu, std::uint8_t motor) {
  const int index = core.mcus_[mcus[mcu.value]].motor_of[motor];
  if (index < 0) return nullptr;
  motion::Axis& axis = core.motors_[static_cast<std::size_t>(index)].axis;
  return axis.busy() ? &axis : nullptr;
}

std::uint16_t AxisSource::render(link::McuIndex mcu, std::uint8_t motor, link::Tick first,
                                 unsigned count, std::int16_t* out, std::size_t stride) {
  motion::Axis* axis = moving_axis(mcu, motor);
  if (axis != nullptr) return axis->render(first, count, out, stride);
  for (unsigned i = 0; i < count; ++i) out[i * stride] = 0;
  return 0;
}

std::optional<link::TickSource::RunSegment> AxisSource::run_at(link::McuIndex mcu,
                                                               std::uint8_t motor, link::Tick first,
                                                               unsigned max_ticks) {
  motion::Axis* axis = moving_axis(mcu, motor);
  if (axis == nullptr) return std::nullopt;
  const auto segment = axis->run_at(first, max_ticks);
  if (!segment) return std::nullopt;
  return RunSegment{.run = segment->run, .ticks = segment->ticks};
}

link::Tick AxisSource::end_tick(link::McuIndex mcu, std::uint8_t motor) {
  const motion::Axis* axis = moving_axis(mcu, motor);
  return axis == nullptr ? 0 : axis->end_tick();
}

Core::Core(const config::Config& config, Outputs& outputs, std::uint16_t master)
    : config_(config),
      outputs_(outputs),
      // The log of moves is appended to: its ids must not begin anew with every daemon.
      last_log_id_(static_cast<std::uint64_t>(outputs.wall_clock_us())) {
  for (const config::Group& group : config.groups) {
    service_.push_back({.table = group.table, .wanted = group.table_name});
  }
  for (const config::Mcu& mcu : config.mcus) {
    Mcu entry{.config = &mcu, .bus = mcu.bus.value, .in_bus = {}, .boot_number = {}};
    entry.motor_of.fill(-1);
    mcus_.push_back(entry);
  }
  for (const config::Motor& motor : config.motors) {
    mcus_[motor.mcu.value].motor_of[motor.output.value] = static_cast<int>(motors_.size());
    motor_by_name_[motor.name] = motors_.size();
    motors_.push_back({.config = &motor,
                       .axis = new_axis(motor),
                       .bus = config.mcu_of(motor).bus.value,
                       .mcu = motor.mcu.value});
  }
  for (std::size_t b = 0; b < config.buses.size(); ++b) {
    const config::Bus& bus = config.buses[b];
    link::BusSetup setup{.baud = bus.baud,
                         .tick_ns = bus.tick_ns(),
                         .format = bus.format,
                         .table_ticks = bus.table_ticks,
                         .master = master,
                         .mcus = {}};
    std::vector<std::size_t> members;
    for (std::size_t m = 0; m < mcus_.size(); ++m) {
      if (mcus_[m].bus != b) continue;
      mcus_[m].in_bus = link::McuIndex{members.size()};
      members.push_back(m);
      setup.mcus.push_back(setup_of(mcus_[m], service_));
    }
    buses_.push_back(std::make_unique<Bus>(std::move(setup), *this));
    buses_.back()->mcus = std::move(members);
  }
}

motion::Axis Core::new_axis(const config::Motor& motor) const {
  const config::Bus& bus = config_.bus_of(motor);
  return {table_of(motor).view(), bus.tick_ns(), bus.format};
}

Core::~Core() = default;

link::Master& Core::master_of(const Mcu& mcu) {
  return buses_[mcu.bus]->master;
}
const link::Master& Core::master_of(const Mcu& mcu) const {
  return buses_[mcu.bus]->master;
}
const link::McuView& Core::view_of(const Mcu& mcu) const {
  return master_of(mcu).view(mcu.in_bus);
}
std::size_t Core::mcu_at(std::size_t bus, link::McuIndex in_bus) const {
  return buses_[bus]->mcus[in_bus.value];
}

void Core::port_opened(std::int64_t now_us, std::size_t bus) {
  buses_[bus]->master.port_opened(now_us);
  buses_[bus]->port_state = "open";
  changed_ = true;
}

void Core::port_lost(std::int64_t now_us, std::size_t bus, const std::string& cause) {
  buses_[bus]->master.port_lost(now_us, cause);
  buses_[bus]->port_state = cause;
  handle_events(now_us, bus);
  changed_ = true;
}

void Core::receive(std::int64_t now_us, std::size_t bus, std::span<const std::uint8_t> bytes) {
  buses_[bus]->master.receive(now_us, bytes);
  handle_events(now_us, bus);
}

void Core::step(std::int64_t now_us) {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    const std::span<const std::uint8_t> bytes = buses_[b]->master.step(now_us);
    if (!bytes.empty()) outputs_.send(b, bytes);
    handle_events(now_us, b);
  }
  check_pending(now_us, std::nullopt);
  follow_table_changes(now_us);
  watch_for_other_masters(now_us);
  if (now_us >= health_due_us_) {
    publish_health();
    health_due_us_ = now_us + kHealthPeriodUs;
  }
  if (changed_) state_due_us_ = std::min(state_due_us_, state_sent_us_ + kMinStatePeriodUs);
  if (now_us >= state_due_us_) {
    publish();
    changed_ = false;
    state_sent_us_ = now_us;
    state_due_us_ = now_us + kStatePeriodUs;
  }
}

std::int64_t Core::next_wake_us() const {
  std::int64_t wake = std::min(state_due_us_, health_due_us_);
  if (changed_) wake = std::min(wake, state_sent_us_ + kMinStatePeriodUs);
  for (const auto& bus : buses_) wake = std::min(wake, bus->master.next_wake_us());
  return wake;
}

std::int64_t Core::rest_by_us(std::int64_t now_us) const {
  std::int64_t latest_us = now_us;
  for (const Motor& motor : motors_) {
    const link::Master& master = buses_[motor.bus]->master;
    if (!motor.axis.busy() || motor.armed || !master.time_known()) continue;
    const motion::Tick ticks = motor.axis.end_tick() - master.tick_at(now_us);
    latest_us = std::max(latest_us, now_us + ticks * config_.buses[motor.bus].tick_us);
  }
  return latest_us;
}

bool Core::at_rest() const {
  return book_.empty() && std::all_of(mcus_.begin(), mcus_.end(),
                                      [](const Mcu& mcu) { return mcu.homings.empty(); });
}

void Core::shut_down(std::int64_t now_us) {
  shutting_down_ = true;
  std::vector<std::size_t> all(motors_.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  stop_motors(now_us, all);
}

}  // namespace bushd::daemon
