// Which table each group has, and how it gets another one: the table is read and checked against
// the buses and MCUs of its motors, the MCUs come to rest, get it and confirm it, and the choice is
// kept for the next daemon. Until then the old one stays in service. A motor that moves keeps its
// table; while a change waits for MCUs to come to rest no motor of theirs begins a move, or it
// might wait for ever.
#include <algorithm>
#include <utility>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "tables/laws/findings.h"

namespace bushd::daemon {
namespace {

constexpr std::int64_t kConfirmUs = 5'000'000;  // beyond what the line needs
constexpr std::int64_t kRequestUs = 100'000;    // lost once, with a slow adapter
constexpr std::size_t kRequestBytes = 350;      // with its answer
constexpr std::size_t kRequestsPerTable = 20;   // beside its codes: begin, end, assignments

std::string name_of(const tables::Table& table) {
  const std::string revision =
      table.revision() > 0 ? "@" + std::to_string(table.revision()) : std::string();
  return table.name() + revision + " (" + table.short_hash() + ")";
}

// For whom it is one table: motors, MCUs and people.
bool same(const tables::Table& a, const tables::Table& b) {
  return a.same_content(b) && a.revision() == b.revision();
}

void add_sentence(std::string& text, const std::string& sentence) {
  text += (text.empty() ? "" : "; ") + sentence;
}

}  // namespace

std::optional<std::size_t> Core::find_group(const std::string& name) const {
  const auto found =
      std::find_if(config_.groups.begin(), config_.groups.end(),
                   [&name](const config::Group& group) { return group.name == name; });
  if (found == config_.groups.end()) return std::nullopt;
  return static_cast<std::size_t>(found - config_.groups.begin());
}

std::string Core::refuse_table_change(const command_t& command) const {
  if (shutting_down_) return "the daemon is shutting down";
  if (!command.motors.empty()) return "tables are given to groups; name no motors";
  if (command.kind == command_t::RELOAD_TABLES) return {};
  if (!find_group(command.group)) {
    return "there is no group \"" + command.group.substr(0, 64) + "\"; 'bushctl status' lists them";
  }
  return command.table.empty() ? "no table is named" : "";
}

void Core::reload_tables() {
  start_table_change({}, command_t::RELOAD_TABLES, {}, {});
}

void Core::start_table_change(const Client& client, std::int8_t kind, const std::string& group,
                              const std::string& wanted) {
  TableChange change{.client = client, .ticket = ++last_ticket_, .kind = kind};
  if (kind == command_t::USE_TABLE) {
    change.parts.push_back({.group = *find_group(group), .wanted = wanted});
  } else {
    for (std::size_t g = 0; g < service_.size(); ++g) {
      change.parts.push_back({.group = g, .wanted = service_[g].wanted});
    }
    // Of a group that is about to get another table, that one is read again.
    for (const TableChange& other : table_changes_) {
      for (const TableChange::Part& part : other.parts)
        change.parts[part.group].wanted = part.wanted;
    }
  }
  std::vector<std::string> all;
  for (const TableChange::Part& part : change.parts) all.push_back(part.wanted);
  outputs_.read_tables(change.ticket, all);
  table_changes_.push_back(std::move(change));
}

void Core::tables_read(std::int64_t now_us, std::uint64_t ticket,
                       const std::vector<Result<tables::TablePtr>>& tables) {
  const auto found =
      std::find_if(table_changes_.begin(), table_changes_.end(),
                   [ticket](const TableChange& change) { return change.ticket == ticket; });
  if (found == table_changes_.end()) return;
  const auto parts = std::exchange(found->parts, {});
  for (std::size_t i = 0; i < parts.size(); ++i) take_part(*found, parts[i], tables[i]);
  if (found->parts.empty() && !found->refused.empty()) {
    finish_table_change(found, reply_t::REFUSED, "refused", found->refused);
    return;
  }
  supersede(*found);
  if (!found->client.id.empty()) answer(found->client, reply_t::ACCEPTED, "", "accepted");
  if (found->parts.empty()) {
    finish_table_change(found, reply_t::RESULT, "done", "no table has changed");
    return;
  }
  if (unchanged(found->parts.front())) return keep(*found);
  found->mcus = mcus_of(found->parts);
  found->stage = TableChange::Stage::kResting;
  follow_table_changes(now_us);
}

bool Core::unchanged(const TableChange::Part& part) const {
  return part.table == service_[part.group].table;
}

// Adds the part to the change, if there is something to change and nothing against it.
void Core::take_part(TableChange& change, TableChange::Part part, Result<tables::TablePtr> read) {
  const std::string group = "group " + config_.groups[part.group].name;
  const InService& now = service_[part.group];
  std::string why = read ? std::string() : read.error().text();
  if (read) {
    part.table = *read;
    std::vector<InService> service = service_;
    for (const TableChange::Part& other : change.parts) service[other.group].table = other.table;
    // Groups with the same table share it, in the MCUs too.
    for (const InService& other : service) {
      if (same(*other.table, *part.table)) part.table = other.table;
    }
    service[part.group].table = part.table;
    why = misfit(service, part.group);
  }
  if (!why.empty()) {
    add_sentence(change.refused, group + " keeps " + name_of(*now.table) + ": " + why);
  } else if (change.kind == command_t::USE_TABLE || !unchanged(part)) {
    change.parts.push_back(std::move(part));
  }
}

// Why these groups' motors could not all move by these tables, looking at one group; "": they can.
std::string Core::misfit(const std::vector<InService>& service, std::size_t group) const {
  const tables::Table& table = *service[group].table;
  for (const Motor& motor : motors_) {
    if (motor.config->group.value != group) continue;
    const tables::laws::Limits limits{.tick_ns = config_.buses[motor.bus].tick_ns()};
    for (const tables::laws::Finding& finding : tables::laws::findings(table, limits)) {
      if (finding.severity != tables::laws::Severity::kError) continue;
      return "table " + table.name() + ": " + finding.rule + ": " + finding.message;
    }
    const Mcu& mcu = mcus_[motor.mcu];
    const link::McuSetup setup = setup_of(mcu, service);
    if (setup.tables.size() > BUSHD_TABLE_SLOTS) {
      return "MCU " + mcu.config->id + " would need " + std::to_string(setup.tables.size()) +
             " different tables; allowed: " + std::to_string(BUSHD_TABLE_SLOTS);
    }
    const std::string why = master_of(mcu).no_room(mcu.in_bus, setup);
    if (!why.empty()) return "MCU " + mcu.config->id + " " + why;
  }
  return {};
}

std::string Core::misfit(const std::vector<TableChange::Part>& parts) const {
  std::vector<InService> service = service_;
  for (const TableChange::Part& part : parts) service[part.group].table = part.table;
  for (const TableChange::Part& part : parts) {
    if (std::string why = misfit(service, part.group); !why.empty()) return why;
  }
  return {};
}

link::McuSetup Core::setup_of(const Mcu& mcu, const std::vector<InService>& service) const {
  link::McuSetup setup{.address = mcu.config->address, .tables = {}};
  setup.emission = mcu.config->emission;
  setup.inputs = inputs_of(mcu);
  setup.off_after_watchdog = mcu.config->enable_after_reset == config::EnableAfterReset::kNo;
  for (std::size_t output = 0; output < BUSHD_MOTORS_PER_MCU; ++output) {
    const int motor = mcu.motor_of[output];
    if (motor < 0) continue;
    const config::Motor& config = config_.motors[static_cast<std::size_t>(motor)];
    if (config.local) setup.local_motors |= static_cast<std::uint16_t>(1u << output);
    const config::GroupIndex group = config.group;
    const tables::Table& table = *service[group.value].table;
    const auto found =
        std::find_if(setup.tables.begin(), setup.tables.end(),
                     [&table](const link::TableRef& ref) { return ref.table == &table.view(); });
    setup.table_of_motor[output] = static_cast<std::uint8_t>(found - setup.tables.begin());
    if (found == setup.tables.end()) {
      setup.tables.push_back({.table = &table.view(), .revision = table.revision()});
    }
  }
  return setup;
}

// Of changes that still wait, the last one counts.
void Core::supersede(const TableChange& by) {
  for (auto it = table_changes_.begin(); it != table_changes_.end();) {
    const auto other = it++;
    if (&*other == &by || other->stage != TableChange::Stage::kResting) continue;
    std::erase_if(other->parts, [&](const TableChange::Part& part) {
      return std::any_of(by.parts.begin(), by.parts.end(),
                         [&](const auto& mine) { return mine.group == part.group; });
    });
    other->mcus = mcus_of(other->parts);
    if (!other->parts.empty()) continue;
    const std::string who = by.client.id.empty() ? "SIGHUP"
                                                 : "command " + std::to_string(by.client.number) +
                                                       " of " + by.client.id;
    finish_table_change(other, reply_t::RESULT, "stopped",
                        "superseded by " + who + " before it took effect");
  }
}

const Core::TableChange* Core::changing(std::size_t mcu) const {
  for (const TableChange& change : table_changes_) {
    const bool waits = change.stage == TableChange::Stage::kResting ||
                       change.stage == TableChange::Stage::kUploading;
    const bool touches =
        std::find(change.mcus.begin(), change.mcus.end(), mcu) != change.mcus.end();
    if (waits && touches) return &change;
  }
  return nullptr;
}

std::vector<std::size_t> Core::mcus_of(const std::vector<TableChange::Part>& parts) const {
  std::vector<std::size_t> motors;
  for (std::size_t m = 0; m < motors_.size(); ++m) {
    const std::size_t group = motors_[m].config->group.value;
    const bool theirs = std::any_of(parts.begin(), parts.end(),
                                    [group](const auto& part) { return part.group == group; });
    if (theirs) motors.push_back(m);
  }
  return mcus_of(motors);
}

// MCUs that are offline get the tables when they come.
bool Core::ready_for_change(const TableChange& change) const {
  for (const TableChange& other : table_changes_) {
    if (other.stage != TableChange::Stage::kUploading) continue;
    const bool overlaps =
        std::any_of(other.mcus.begin(), other.mcus.end(), [&change](std::size_t mcu) {
          return std::find(change.mcus.begin(), change.mcus.end(), mcu) != change.mcus.end();
        });
    if (overlaps) return false;
  }
  return std::all_of(change.mcus.begin(), change.mcus.end(), [this](std::size_t index) {
    const Mcu& mcu = mcus_[index];
    const link::McuView& view = view_of(mcu);
    if (view.phase == link::McuPhase::kConnecting) return false;
    for (const int motor : mcu.motor_of) {
      if (motor >= 0 && is_moving(static_cast<std::size_t>(motor))) return false;
    }
    if (view.phase == link::McuPhase::kOffline) return true;
    return view.report.moving == 0 && !master_of(mcu).busy(mcu.in_bus);
  });
}

void Core::put_in_service(std::size_t group, tables::TablePtr table) {
  service_[group].table = std::move(table);
  for (Motor& motor : motors_) {
    if (motor.config->group.value == group) motor.axis = new_axis(*motor.config);
  }
}

void Core::begin_upload(std::int64_t now_us, TableChange& change) {
  for (TableChange::Part& part : change.parts) {
    part.before = service_[part.group].table;
    put_in_service(part.group, part.table);
  }
  change.deadline_us = now_us + kConfirmUs;
  std::string absent;
  for (const std::size_t index : change.mcus) {
    const Mcu& mcu = mcus_[index];
    master_of(mcu).reconfigure(mcu.in_bus, setup_of(mcu, service_));
    if (view_of(mcu).phase == link::McuPhase::kOffline) {
      absent += " " + mcu.config->id;
    } else {
      change.awaited.push_back(index);
      change.deadline_us += upload_us(mcu);
    }
  }
  if (!absent.empty())
    add_sentence(change.notes, "not online, they get it when they come:" + absent);
  change.stage = TableChange::Stage::kUploading;
  changed_ = true;
}

std::int64_t Core::upload_us(const Mcu& mcu) const {
  std::size_t requests = 0;
  for (const link::TableRef& ref : setup_of(mcu, service_).tables) {
    const std::size_t codes = ref.table->accel.count + ref.table->decel.count;
    requests += kRequestsPerTable + codes / BUSHD_TABLE_DATA_MAX_CODES;
  }
  const auto line_us =
      static_cast<std::int64_t>(kRequestBytes * 10'000'000 / config_.buses[mcu.bus].baud);
  return static_cast<std::int64_t>(requests) * (kRequestUs + line_us);
}

bool Core::uploaded(const TableChange& change) const {
  return std::all_of(change.awaited.begin(), change.awaited.end(), [this](std::size_t index) {
    const Mcu& mcu = mcus_[index];
    return view_of(mcu).phase == link::McuPhase::kOnline && !master_of(mcu).busy(mcu.in_bus);
  });
}

void Core::roll_back(TableChange& change) {
  std::string who;
  for (const std::size_t index : change.awaited) {
    const link::McuView& view = view_of(mcus_[index]);
    if (view.phase == link::McuPhase::kOnline) continue;
    add_sentence(who,
                 "MCU " + mcus_[index].config->id + " did not confirm it in time: " + view.detail);
  }
  for (const TableChange::Part& part : change.parts) {
    put_in_service(part.group, part.before);
    add_sentence(who,
                 "group " + config_.groups[part.group].name + " keeps " + name_of(*part.before));
  }
  for (const std::size_t index : mcus_of(change.parts)) {
    master_of(mcus_[index]).reconfigure(mcus_[index].in_bus, setup_of(mcus_[index], service_));
  }
  change.notes = who;
}

void Core::keep(TableChange& change) {
  change.stage = TableChange::Stage::kKeeping;
  std::vector<std::string> all;
  for (const TableChange::Part& part : change.parts) service_[part.group].wanted = part.wanted;
  for (const InService& service : service_) all.push_back(service.wanted);
  outputs_.keep_tables(change.ticket, all);
}

void Core::follow_table_changes(std::int64_t now_us) {
  for (auto it = table_changes_.begin(); it != table_changes_.end();) {
    const auto change = it++;
    if (change->stage == TableChange::Stage::kResting && ready_for_change(*change)) {
      // Other changes may have come before, or MCUs with less memory.
      const std::string why = misfit(change->parts);
      if (!why.empty()) {
        finish_table_change(change, reply_t::RESULT, "fault", why);
        continue;
      }
      begin_upload(now_us, *change);
    }
    if (change->stage != TableChange::Stage::kUploading) continue;
    if (uploaded(*change)) {
      keep(*change);
    } else if (now_us > change->deadline_us) {
      roll_back(*change);
      finish_table_change(change, reply_t::RESULT, "fault", change->notes);
    }
  }
}

void Core::tables_kept(std::uint64_t ticket, const Result<void>& kept) {
  const auto found =
      std::find_if(table_changes_.begin(), table_changes_.end(),
                   [ticket](const TableChange& change) { return change.ticket == ticket; });
  if (found == table_changes_.end()) return;
  std::string text;
  for (const TableChange::Part& part : found->parts) {
    const tables::Table& table = *service_[part.group].table;
    add_sentence(text, "group " + config_.groups[part.group].name + " has " + name_of(table));
  }
  if (!found->notes.empty()) add_sentence(text, found->notes);
  if (!kept) add_sentence(text, "a restart of the daemon will not know it: " + kept.error().text());
  if (!found->refused.empty()) add_sentence(text, found->refused);
  const bool all = found->refused.empty();
  finish_table_change(found, reply_t::RESULT, all ? "done" : "fault", text);
}

void Core::finish_table_change(std::list<TableChange>::iterator change, std::int8_t phase,
                               const std::string& result, std::string reason) {
  const TableChange finished = std::move(*change);
  table_changes_.erase(change);
  changed_ = true;
  if (finished.client.id.empty() || phase == reply_t::RESULT) {
    outputs_.log(result == "done" ? LogLevel::kInfo : LogLevel::kError, "tables: " + reason);
  }
  if (!finished.client.id.empty()) answer(finished.client, phase, result, reason);
}

std::string Core::refuse_content(const std::string& name, const tables::TablePtr& table) const {
  std::vector<InService> service = service_;
  for (InService& group : service) {
    if (group.wanted == name) group.table = table;
  }
  for (std::size_t group = 0; group < service.size(); ++group) {
    if (service[group].wanted != name) continue;
    const std::string why = misfit(service, group);
    if (!why.empty()) return "group " + config_.groups[group].name + " has it, and " + why;
  }
  return {};
}

Result<void> Core::restore(std::size_t group, const std::string& wanted, tables::TablePtr table) {
  std::vector<InService> service = service_;
  for (const InService& other : service_) {
    if (same(*other.table, *table)) table = other.table;
  }
  service[group].table = table;
  if (const std::string why = misfit(service, group); !why.empty()) return fail(why);
  put_in_service(group, table);
  service_[group].wanted = wanted;
  for (const Mcu& mcu : mcus_) {
    master_of(mcu).reconfigure(mcu.in_bus, setup_of(mcu, service_));
  }
  outputs_.log(LogLevel::kInfo, "group " + config_.groups[group].name + " has table " + wanted +
                                    ", " + name_of(*table) + ", as it was given; configured is " +
                                    config_.groups[group].table_name);
  return {};
}

}  // namespace bushd::daemon
