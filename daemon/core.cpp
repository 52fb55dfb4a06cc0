#include "daemon/core.h"

#include <algorithm>
#include <set>

#include "daemon/bus.h"

namespace bushd::daemon {

motion::Axis* Core::Bus::moving_axis(std::size_t mcu, std::uint8_t motor) {
  const int index = core.mcus_[mcus[mcu]].motor_of[motor];
  if (index < 0) return nullptr;
  motion::Axis& axis = core.motors_[static_cast<std::size_t>(index)].axis;
  return axis.busy() ? &axis : nullptr;
}

std::uint16_t Core::Bus::render(std::size_t mcu, std::uint8_t motor, link::Tick first,
                                unsigned count, std::int16_t* out, std::size_t stride) {
  motion::Axis* axis = moving_axis(mcu, motor);
  if (axis != nullptr) return axis->render(first, count, out, stride);
  for (unsigned i = 0; i < count; ++i) out[i * stride] = 0;
  return 0;
}

std::optional<link::TickSource::Stretch> Core::Bus::run_at(std::size_t mcu, std::uint8_t motor,
                                                           link::Tick first, unsigned max_ticks) {
  motion::Axis* axis = moving_axis(mcu, motor);
  if (axis == nullptr) return std::nullopt;
  const auto stretch = axis->run_at(first, max_ticks);
  if (!stretch) return std::nullopt;
  return Stretch{.run = stretch->run, .ticks = stretch->ticks};
}

link::Tick Core::Bus::end_tick(std::size_t mcu, std::uint8_t motor) {
  const motion::Axis* axis = moving_axis(mcu, motor);
  return axis == nullptr ? 0 : axis->end_tick();
}

Core::Core(const config::Config& config, Outputs& outputs, std::uint16_t master)
    : config_(config),
      outputs_(outputs),
      // The log of moves is appended to: its ids must not begin anew with every daemon.
      last_log_id_(static_cast<std::uint64_t>(outputs.wall_clock_us())) {
  for (const config::Group& group : config.groups) tables_.push_back(group.table);
  for (const config::Mcu& mcu : config.mcus) {
    Mcu entry{.config = &mcu, .bus = mcu.bus.value, .in_bus = 0, .boot_number = {}};
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
      mcus_[m].in_bus = members.size();
      members.push_back(m);
      setup.mcus.push_back(setup_of(mcus_[m]));
    }
    buses_.push_back(std::make_unique<Bus>(std::move(setup), *this));
    buses_.back()->mcus = std::move(members);
  }
}

motion::Axis Core::new_axis(const config::Motor& motor) const {
  const config::Bus& bus = config_.bus_of(motor);
  return {table_of(motor).view(), bus.tick_ns(), bus.format};
}

link::McuSetup Core::setup_of(const Mcu& mcu) const {
  link::McuSetup setup{.address = mcu.config->address.value, .tables = {}};
  setup.table_of_motor.fill(-1);
  for (std::size_t output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
    const int motor = mcu.motor_of[output];
    if (motor < 0) continue;
    const tables::Table& table = table_of(config_.motors[static_cast<std::size_t>(motor)]);
    const auto found =
        std::find_if(setup.tables.begin(), setup.tables.end(),
                     [&table](const link::TableRef& ref) { return ref.table == &table.view(); });
    setup.table_of_motor[output] = static_cast<int>(found - setup.tables.begin());
    if (found == setup.tables.end()) {
      setup.tables.push_back({.table = &table.view(), .revision = table.revision()});
    }
  }
  return setup;
}

Result<void> Core::reload_tables(const config::Config& fresh) {
  if (!config::same_but_for_tables(config_, fresh)) {
    return fail("more than tables has changed; restart the daemon to take it over");
  }
  std::set<std::size_t> changed_mcus;
  std::set<std::size_t> changed_groups;
  for (std::size_t m = 0; m < motors_.size(); ++m) {
    const config::GroupIndex group = motors_[m].config->group;
    const tables::Table& before = *tables_[group.value];
    const tables::Table& after = *fresh.groups[group.value].table;
    if (before.same_content(after) && before.revision() == after.revision()) continue;
    changed_groups.insert(group.value);
    changed_mcus.insert(motors_[m].mcu);
  }
  for (const Motor& motor : motors_) {
    if (motor.axis.busy() && changed_mcus.contains(motor.mcu)) {
      return fail("motor " + motor.config->name + " moves on MCU " + mcus_[motor.mcu].config->id +
                  ", which would need a changed table; reload when it is at rest");
    }
  }
  for (const std::size_t group : changed_groups) tables_[group] = fresh.groups[group].table;
  for (Motor& motor : motors_) {
    if (changed_groups.contains(motor.config->group.value)) motor.axis = new_axis(*motor.config);
  }
  for (const std::size_t index : changed_mcus) {
    const Mcu& mcu = mcus_[index];
    master_of(mcu).reconfigure(mcu.in_bus, setup_of(mcu));
  }
  for (const std::size_t group : changed_groups) {
    outputs_.log(LogLevel::kInfo, "group " + config_.groups[group].name + " has table " +
                                      tables_[group]->name() + " from " + tables_[group]->path());
  }
  changed_ = true;
  return {};
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
std::size_t Core::mcu_at(std::size_t bus, std::size_t in_bus) const {
  return buses_[bus]->mcus[in_bus];
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
    if (!motor.axis.busy() || !master.time_known()) continue;
    const motion::Tick ticks = motor.axis.end_tick() - master.tick_at(now_us);
    latest_us = std::max(latest_us, now_us + ticks * config_.buses[motor.bus].tick_us);
  }
  return latest_us;
}

void Core::shut_down(std::int64_t now_us) {
  shutting_down_ = true;
  std::vector<std::size_t> all(motors_.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  stop_motors(now_us, all);
}

}  // namespace bushd::daemon
