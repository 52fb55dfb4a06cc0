#include "daemon/model/installation.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <utility>

#include "api/no_such_motor.h"
#include "base/nearest_name.h"
#include "base/output_bits.h"
#include "base/shortened.h"

namespace bushd::daemon {
namespace {

constexpr std::size_t kMostUnknownNames = 4;  // that an answer tells; there may be any number

}  // namespace

std::uint16_t AxisSource::render(link::McuIndex mcu, std::uint8_t motor, link::Tick first,
                                 unsigned count, std::int16_t* out, std::size_t stride) {
  motion::Axis* axis = axis_of(mcu, Output{motor});
  if (axis != nullptr) return axis->render(first, count, out, stride);
  for (unsigned i = 0; i < count; ++i) out[i * stride] = 0;
  return 0;
}

std::optional<link::TickSource::RunSegment> AxisSource::run_at(link::McuIndex mcu,
                                                               std::uint8_t motor, link::Tick first,
                                                               unsigned max_ticks) {
  motion::Axis* axis = axis_of(mcu, Output{motor});
  if (axis == nullptr) return std::nullopt;
  const auto segment = axis->run_at(first, max_ticks);
  if (!segment) return std::nullopt;
  return RunSegment{.run = segment->run, .ticks = segment->ticks};
}

std::optional<bushd_run> AxisSource::plan_at(link::McuIndex mcu, std::uint8_t motor,
                                             link::Tick at) {
  motion::Axis* axis = axis_of(mcu, Output{motor});
  return axis == nullptr ? std::nullopt : axis->plan_at(at);
}

std::optional<link::MotorPlan> AxisSource::plan_on_line_at(link::McuIndex mcu, std::uint8_t motor,
                                                           link::Tick at) {
  motion::Axis* axis = axis_of(mcu, Output{motor});
  if (axis == nullptr) return std::nullopt;
  const auto run = axis->line_run_at(at);
  if (!run) return std::nullopt;
  const motion::LineShare& share = *axis->line();
  return link::MotorPlan{.run = *run,
                         .line = link::MotorPlan::Line{.increment = share.increment,
                                                       .longest = share.longest,
                                                       .from = share.from,
                                                       .direction = share.direction}};
}

link::Tick AxisSource::end_tick(link::McuIndex mcu, std::uint8_t motor) {
  const motion::Axis* axis = axis_of(mcu, Output{motor});
  return axis == nullptr ? 0 : axis->end_tick();
}

motion::Axis* Bus::axis_of(link::McuIndex mcu, Output output) {
  const auto id = installation_[mcus[mcu.value]].motor_at(output);
  if (!id) return nullptr;
  motion::Motor& motor = installation_[*id];
  return motor.has_plan() ? &motor.axis() : nullptr;
}

Result<void> Mcu::must_be_online() const {
  if (online() && view().outdated_us == 0) return {};
  if (online()) return fail("MCU " + name() + " has not reported since this daemon stood still");
  return fail("MCU " + name() + " is offline: " + view().detail);
}

Result<void> Mcu::has_room(const link::McuSetup& setup) const {
  const auto room = master_.check_room(on_bus_, setup);
  if (room) return {};
  return fail("MCU " + name() + " " + room.error().text());
}

Installation::Installation(const config::Config& config, std::uint16_t master) : config_(config) {
  for (const config::Group& group : config.groups) tables_.add(group.table);
  for (const config::Motor& motor : config.motors) {
    drives_.add(motor.drive);
    moved_by_people_ += motor.drive.moved_by_people();
  }
  add_buses(master);
  add_mcus();
  add_motors();
}

void Installation::add_buses(std::uint16_t master) {
  for (const config::Bus& bus : config_.buses) {
    const BusId id{buses_.size()};
    link::BusSetup setup{.baud = bus.baud,
                         .tick_ns = bus.tick_ns(),
                         .format = bus.format,
                         .table_ticks = bus.table_ticks,
                         .master = master,
                         .mcus = {}};
    std::vector<McuId> members;
    for (std::size_t m = 0; m < config_.mcus.size(); ++m) {
      if (config_.mcus[m].bus != id) continue;
      members.push_back({m});
      setup.mcus.push_back(setup_of({m}));
    }
    buses_.add(std::make_unique<Bus>(bus, std::move(setup), *this));
    buses_[id]->mcus = std::move(members);
  }
}

void Installation::add_mcus() {
  for (const config::Mcu& mcu : config_.mcus) {
    const McuId id{mcus_.size()};
    Bus& bus = *buses_[mcu.bus];
    const auto place = std::ranges::find(bus.mcus, id) - bus.mcus.begin();
    mcus_.add(id, mcu, bus, link::McuIndex{static_cast<std::size_t>(place)});
  }
}

void Installation::add_motors() {
  for (const config::Motor& config : config_.motors) {
    const config::Mcu& mcu = config_.mcu_of(config);
    const config::Bus& bus = config_.bus_of(mcu);
    const MotorId id = motors_.add(
        motion::MotorSetup{
            .name = config.name,
            .mcu = mcu.id,
            .output = config.output,
            .has_home = config.home.has_value(),
            .restored_refused = config.restored_refused,
            .limit_immediate = config.limit_action == BUSHD_STOP_IMMEDIATE,
            .emergency_stop_immediate = bus.emergency_stop != BUSHD_STOP_RAMP,
            .emergency_input_immediate = mcu.emergency_input >= BUSHD_EMERGENCY_INPUT_IMMEDIATE,
            .scale = motion::MotorScale(config.coordinates, config.soft_limits, config.max_speed),
            .backlash = config.backlash,
            .backlash_speed = config.backlash_speed,
            .settle_ticks = (config.settle_ms * 1000 + bus.tick_us - 1) / bus.tick_us},
        new_axis({motors_.size()}));
    motor_by_name_[config.name] = id;
    mcus_[config.mcu].motor_at_[config.output.value] = id;
  }
  for (Mcu& mcu : mcus_) {
    for (const auto& motor : mcu.motor_at_) {
      if (motor) mcu.motors_.push_back(*motor);
    }
  }
}

std::vector<McuId> Installation::mcus_of(const std::vector<MotorId>& motors) const {
  std::set<McuId> mcus;
  for (const MotorId motor : motors) mcus.insert(config_[motor].mcu);
  return {mcus.begin(), mcus.end()};
}

std::vector<MotorId> Installation::to_be_homed(const Mcu& mcu) const {
  std::vector<MotorId> motors;
  if (!mcu.config.ready_after_homing || !mcu.online()) return motors;
  for (const MotorId motor : mcu.motors()) {
    const bool homed = has_bit(mcu.report().homed, motors_[motor].output());
    if (config_[motor].home && !homed) motors.push_back(motor);
  }
  return motors;
}

std::vector<MotorId> Installation::with_lines(std::vector<MotorId> motors) const {
  std::set<std::uint64_t> lines;
  for (const MotorId id : motors) {
    const auto* on_line = motors_[id].as<motion::OnLine>();
    if (on_line != nullptr) lines.insert(on_line->line);
  }
  if (lines.empty()) return motors;
  std::set<MotorId> named(motors.begin(), motors.end());
  for (const MotorId id : motors_.ids()) {
    const auto* on_line = motors_[id].as<motion::OnLine>();
    if (on_line == nullptr || !lines.contains(on_line->line)) continue;
    if (named.insert(id).second) motors.push_back(id);
  }
  return motors;
}

link::LineRun Mcu::line_run(const motion::LineShare& share, bushd_delay shortest_delay,
                            link::Tick ticks) const {
  // What really begins has its table there. A dry run may ask before: this is where it would be.
  const auto bank = offers.line_runs->bank_of(on_bus_, share.table->view());
  return {.bank = bank.value_or(BUSHD_SCRATCH_BANK),
          .elementary = share.elementary != nullptr,
          .shortest_delay = shortest_delay,
          .longest = share.longest,
          .from = share.from,
          .steps = share.to - share.from,
          .ticks = ticks,
          .increment = share.increment,
          .direction = share.direction};
}

bool Installation::any_moves(const Mcu& mcu) const {
  return std::ranges::any_of(
      mcu.motors(), [this](MotorId motor) { return !motors_[motor].is<motion::Resting>(); });
}

bool Installation::rests(const Mcu& mcu) const {
  return !any_moves(mcu) && (!mcu.online() || mcu.report().moving == 0);
}

bool Installation::by_table(const Mcu& mcu, std::int64_t steps, bushd_delay shortest_delay) const {
  return (bus_of(mcu).config.table_runs || !mcu.offers.streams) && mcu.can_run_tables() &&
         (bushd_delay_is_code(shortest_delay) || mcu.can_run_slowly()) &&
         std::abs(steps) <= motion::Motor::kMaxPosition;
}

std::vector<std::string_view> Installation::names(bool of_groups) const {
  std::vector<std::string_view> all;
  for (const config::Motor& motor : config_.motors) all.emplace_back(motor.name);
  for (const config::Pseudo& pseudo : config_.pseudos) {
    for (const config::PseudoAxis& axis : pseudo.axes) all.emplace_back(axis.name);
  }
  if (!of_groups) return all;
  for (const config::Group& group : config_.groups) all.emplace_back(group.name);
  return all;
}

Result<MotorId> Installation::find(const std::string& name) const {
  const auto found = motor_by_name_.find(name);
  if (found != motor_by_name_.end()) return found->second;
  std::vector<std::string> groups;
  for (const config::Group& group : config_.groups) groups.push_back(group.name);
  return fail(api::no_such_motor(name, this->names(false), std::move(groups)) +
              "; 'bushctl status' lists them");
}

Result<std::vector<MotorId>> Installation::find(const api::MotorNames& names) const {
  std::vector<MotorId> motors;
  std::set<MotorId> seen;
  for (const std::string& name : names) {
    const auto motor = find(name);
    if (!motor) return fail(motor.error());
    if (!seen.insert(*motor).second) return fail("motor " + name + " is named twice");
    motors.push_back(*motor);
  }
  if (motors.empty()) return fail("no motor is named");
  return motors;
}

Result<std::vector<MotorId>> Installation::find(const std::vector<api::MotorAmount>& motors) const {
  api::MotorNames names;
  for (const api::MotorAmount& motor : motors) names.push_back(motor.motor);
  return find(names);
}

Result<std::vector<MotorId>> Installation::find_or_all(const api::MotorNames& names) const {
  if (!names.empty()) return find(names);
  std::vector<MotorId> all;
  for (const MotorId motor : motors()) all.push_back(motor);
  return all;
}

Result<std::vector<MotorId>> Installation::find_with_groups(const api::MotorNames& names) const {
  if (names.empty()) return find_or_all({});
  std::set<MotorId> found;
  for (const std::string& name : names) {
    const auto motor = find(name);
    if (motor) {
      found.insert(*motor);
      continue;
    }
    const auto group = std::ranges::find(config_.groups, name, &config::Group::name);
    if (group == config_.groups.end()) {
      return fail("there is no motor or group \"" + shortened(name, 64) + "\"" +
                  did_you_mean(name, this->names(true)) + "; 'bushctl status' lists them");
    }
    const GroupId id{static_cast<std::size_t>(group - config_.groups.begin())};
    for (const MotorId of_group : motors()) {
      if (config_[of_group].group == id) found.insert(of_group);
    }
  }
  return std::vector<MotorId>(found.begin(), found.end());
}

Installation::Known Installation::find_known(const api::MotorNames& names, bool groups) const {
  Known known;
  if (names.empty()) {
    for (const MotorId motor : motors()) known.motors.push_back(motor);
    return known;
  }
  std::set<MotorId> seen;
  std::set<std::string> unknown;
  for (const std::string& name : names) {
    const auto found = groups ? find_with_groups({name})
                              : find(name).map([](MotorId motor) { return std::vector{motor}; });
    if (!found) {
      if (!unknown.insert(name).second || unknown.size() > kMostUnknownNames) continue;
      known.unknown += (known.unknown.empty() ? "" : "; ") + found.error().text();
      continue;
    }
    for (const MotorId motor : *found) {
      if (seen.insert(motor).second) known.motors.push_back(motor);
    }
  }
  return known;
}

std::string Installation::not_online(const std::vector<MotorId>& motors) const {
  std::string names;
  for (const McuId mcu : mcus_of(motors)) {
    if (!mcus_[mcu].online()) names += " " + mcus_[mcu].name();
  }
  return names;
}

motion::Axis Installation::new_axis(MotorId id) const {
  const config::Bus& bus = config_.bus_of(config_[id]);
  return {table_of(id)->view(), bus.tick_ns(), bus.format};
}

Result<void> Installation::has_table(MotorId id, const Tables& tables, const Drives& drives) const {
  const auto table = gentler_.of(tables[config_[id].group], drives[id].acceleration);
  if (table) return {};
  return fail(motors_[id].name() + ": acceleration: " + table.error().message);
}

// Host and MCU ask here, so they have the same one in any case.
tables::TablePtr Installation::table_of(MotorId id, const Tables& tables,
                                        const Drives& drives) const {
  const tables::TablePtr& of_group = tables[config_[id].group];
  return gentler_.of(of_group, drives[id].acceleration).value_or(of_group);
}

link::McuSetup Installation::setup_of(McuId mcu, const Tables& tables, const Drives& drives) const {
  return daemon::setup_of(
      config_, mcu, [&](MotorId id) { return table_of(id, tables, drives); }, drives);
}

void Installation::put(MotorId id, const config::Drive& drive) {
  const bool other_table = drives_[id].acceleration != drive.acceleration;
  moved_by_people_ -= drives_[id].moved_by_people();
  moved_by_people_ += drive.moved_by_people();
  drives_[id] = drive;
  for (const MotorId other : motors_.ids()) {
    if (config_[other].mcu == config_[id].mcu) drives_[other].phase_sequence = drive.phase_sequence;
  }
  if (other_table) motors_[id].axis() = new_axis(id);
}

void Installation::put_in_service(GroupId group, tables::TablePtr table) {
  tables_[group] = std::move(table);
  for (const MotorId id : motors_.ids()) {
    if (config_[id].group == group) motors_[id].axis() = new_axis(id);
  }
}

}  // namespace bushd::daemon
