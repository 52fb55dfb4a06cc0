#include "daemon/services/tables_in_service.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "base/nearest_name.h"
#include "daemon/model/confirmation.h"
#include "daemon/services/open_moves.h"
#include "tables/profiles/diagnostics.h"

namespace bushd::daemon {
namespace {

constexpr std::int64_t kRequestUs = 100'000;   // lost once, with a slow adapter
constexpr std::size_t kRequestBytes = 350;     // with its answer
constexpr std::size_t kRequestsPerTable = 20;  // beside its codes: begin, end, assignments

std::string text_of(const tables::Table& table) {
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

Result<void> check_by_tick(const tables::Table& table, std::uint32_t tick_ns) {
  const tables::profiles::Limits limits{.tick_ns = tick_ns};
  for (const tables::profiles::Diagnostic& diagnostic :
       tables::profiles::diagnostics(table, limits)) {
    if (diagnostic.severity != tables::profiles::Severity::kError) continue;
    return fail("table " + table.name() + ": " + diagnostic.rule + ": " + diagnostic.message);
  }
  return {};
}

std::optional<GroupId> find_group(const config::Config& config, const std::string& name) {
  const auto found = std::ranges::find(config.groups, name, &config::Group::name);
  if (found == config.groups.end()) return std::nullopt;
  return GroupId{static_cast<std::size_t>(found - config.groups.begin())};
}

}  // namespace

TableReview::TableReview(const config::Config& config, tables::TablePtr of) : table(std::move(of)) {
  for (const config::Bus& bus : config.buses) {
    if (by_tick_ns.contains(bus.tick_ns())) continue;
    by_tick_ns.emplace(bus.tick_ns(), check_by_tick(*table, bus.tick_ns()));
  }
}

TablesInService::TablesInService(Installation& installation, Interlocks& interlocks,
                                 Outputs& outputs)
    : installation_(installation), outputs_(outputs) {
  for (const config::Group& group : installation.config().groups) wanted_.add(group.table_name);
  interlocks.add([this](MotorId motor) -> Result<void> {
    // One that moves keeps its table.
    if (installation_[motor].has_plan()) return {};
    const Mcu& mcu = installation_.mcu_of(motor);
    const Change* change = changing(mcu.id);
    if (change == nullptr) return {};
    return fail("MCU " + mcu.name() + " is about to get another table, for group " +
                name_of(change->parts.front().group) + "; wait for that result");
  });
}

const std::string& TablesInService::name_of(GroupId group) const {
  return installation_.config()[group].name;
}

void TablesInService::request(const api::Asker& asker, const api::UseTable& request) {
  const auto group = find_group(installation_.config(), request.group);
  if (installation_.shutting_down) {
    asker.answer(api::Refused{"the daemon is shutting down"});
  } else if (!group) {
    std::vector<std::string> groups;
    for (const config::Group& known : installation_.config().groups) groups.push_back(known.name);
    asker.answer(api::Refused{"there is no group \"" + request.group.substr(0, 64) + "\"" +
                              did_you_mean(request.group, groups) +
                              "; 'bushctl status' lists them"});
  } else if (request.table.empty()) {
    asker.answer(api::Refused{"no table is named"});
  } else {
    Change change{.asker = asker, .ticket = ++last_ticket_};
    change.parts.push_back({.group = *group, .wanted = request.table});
    begin(std::move(change));
  }
}

void TablesInService::request(const api::Asker& asker, const api::ReloadTables&) {
  if (installation_.shutting_down) {
    return asker.answer(api::Refused{"the daemon is shutting down"});
  }
  Change change{.asker = asker, .ticket = ++last_ticket_, .reload = true};
  for (const GroupId group : wanted_.ids()) {
    change.parts.push_back({.group = group, .wanted = wanted_[group]});
  }
  // The table that a group is about to get is read again.
  for (const Change& other : changes_) {
    if (!other.kept) continue;
    for (const Part& part : other.parts) change.parts[part.group.value].wanted = part.wanted;
  }
  begin(std::move(change));
}

void TablesInService::begin(Change change) {
  std::vector<std::string> all;
  for (const Part& part : change.parts) all.push_back(part.wanted);
  outputs_.read_tables(change.ticket, all);
  changes_.push_back(std::move(change));
}

TablesInService::Changes::iterator TablesInService::find(std::uint64_t ticket) {
  return std::ranges::find(changes_, ticket, &Change::ticket);
}

void TablesInService::read(std::int64_t now_us, std::uint64_t ticket,
                           const std::vector<Result<tables::TablePtr>>& tables) {
  const auto change = find(ticket);
  if (change == changes_.end()) return;
  const auto parts = std::exchange(change->parts, {});
  for (std::size_t i = 0; i < parts.size(); ++i) take_part(*change, parts[i], tables[i]);
  put_in_service(now_us, change);
}

void TablesInService::use(std::int64_t now_us, const api::Asker& asker, GroupId group,
                          tables::TablePtr table) {
  const auto change =
      changes_.insert(changes_.end(), {.asker = asker, .ticket = ++last_ticket_, .kept = false});
  take_part(*change, {.group = group, .wanted = table->name()}, table);
  put_in_service(now_us, change);
}

// Its tables are read.
void TablesInService::put_in_service(std::int64_t now_us, Changes::iterator change) {
  if (change->parts.empty() && !change->refused.empty()) return refuse(change);
  supersede(*change);
  change->asker.answer(api::Accepted{});
  if (change->parts.empty()) {
    return complete(change, api::Outcome::kDone, "no table has changed");
  }
  if (unchanged(change->parts.front())) return keep(change);
  change->mcus = mcus_of(change->parts);
  change->stage = Change::Stage::kResting;
  step(now_us);
}

bool TablesInService::unchanged(const Part& part) const {
  return part.table == installation_.tables()[part.group];
}

// Groups with the same table share it, in the MCUs too.
tables::TablePtr TablesInService::shared(const Tables& tables, tables::TablePtr table) const {
  for (const tables::TablePtr& other : tables) {
    if (same(*other, *table)) table = other;
  }
  return table;
}

// Adds the part to the change, if there is something to change and nothing against it.
void TablesInService::take_part(Change& change, Part part, const Result<tables::TablePtr>& read) {
  Result<void> good;
  if (read) {
    Tables tables = installation_.tables();
    for (const Part& other : change.parts) tables[other.group] = other.table;
    part.table = shared(tables, *read);
    tables[part.group] = part.table;
    good = fits(tables, part.group);
  } else {
    good = fail(read.error());
  }
  if (!good) {
    add_sentence(change.refused, "group " + name_of(part.group) + " keeps " +
                                     text_of(*installation_.tables()[part.group]) + ": " +
                                     good.error().text());
  } else if (!change.reload || !unchanged(part)) {
    change.parts.push_back(std::move(part));
  }
}

// Whether these groups' motors could all move by these tables, looking at one group.
// Each tick and each MCU is looked at once, however many motors there are.
Result<void> TablesInService::fits(const Tables& tables, GroupId group,
                                   const TableReview* review) const {
  const tables::Table& table = *tables[group];
  std::set<std::uint32_t> ticks;
  std::set<McuId> mcus;
  for (const MotorId id : installation_.motors()) {
    if (installation_.config()[id].group != group) continue;
    if (auto good = installation_.has_table(id, tables, installation_.drives()); !good) return good;
    const Mcu& mcu = installation_.mcu_of(id);
    if (!mcus.insert(mcu.id).second) continue;
    const std::uint32_t tick_ns = installation_.bus_of(mcu).config.tick_ns();
    if (ticks.insert(tick_ns).second) {
      auto good =
          review != nullptr ? review->by_tick_ns.at(tick_ns) : check_by_tick(table, tick_ns);
      if (!good) return good;
    }
    const link::McuSetup setup = installation_.setup_of(mcu.id, tables, installation_.drives());
    if (setup.tables.size() > BUSHD_TABLE_BANKS) {
      return fail("MCU " + mcu.name() + " would need " + std::to_string(setup.tables.size()) +
                  " different tables; allowed: " + std::to_string(BUSHD_TABLE_BANKS));
    }
    if (auto room = mcu.has_room(setup); !room) return room;
  }
  return {};
}

Result<void> TablesInService::fits(const std::vector<Part>& parts) const {
  Tables tables = installation_.tables();
  for (const Part& part : parts) tables[part.group] = part.table;
  for (const Part& part : parts) {
    if (auto good = fits(tables, part.group); !good) return good;
  }
  return {};
}

// The last one counts of changes that still wait.
void TablesInService::supersede(const Change& by) {
  for (auto it = changes_.begin(); it != changes_.end();) {
    const auto other = it++;
    if (&*other == &by || other->stage != Change::Stage::kResting) continue;
    std::erase_if(other->parts, [&](const Part& part) {
      return std::ranges::find(by.parts, part.group, &Part::group) != by.parts.end();
    });
    other->mcus = mcus_of(other->parts);
    if (!other->parts.empty()) continue;
    complete(other, api::Outcome::kStopped,
             "superseded by " + text_of(by.asker) + " before it took effect");
  }
}

const TablesInService::Change* TablesInService::changing(McuId mcu) const {
  for (const Change& change : changes_) {
    const bool waits =
        change.stage == Change::Stage::kResting || change.stage == Change::Stage::kUploading;
    if (waits && std::ranges::find(change.mcus, mcu) != change.mcus.end()) return &change;
  }
  return nullptr;
}

std::vector<McuId> TablesInService::mcus_of(const std::vector<Part>& parts) const {
  std::vector<MotorId> motors;
  for (const MotorId motor : installation_.motors()) {
    const GroupId group = installation_.config()[motor].group;
    if (std::ranges::find(parts, group, &Part::group) != parts.end()) motors.push_back(motor);
  }
  return installation_.mcus_of(motors);
}

bool TablesInService::waits_for_motors(GroupId group) const {
  return std::ranges::any_of(mcus_of({{.group = group, .wanted = {}}}),
                             [this](McuId id) { return !installation_.rests(installation_[id]); });
}

// MCUs that are offline get the tables when they come.
bool TablesInService::ready(const Change& change) const {
  for (const Change& other : changes_) {
    if (other.stage != Change::Stage::kUploading) continue;
    const bool overlaps = std::ranges::any_of(other.mcus, [&change](McuId mcu) {
      return std::ranges::find(change.mcus, mcu) != change.mcus.end();
    });
    if (overlaps) return false;
  }
  return std::ranges::all_of(change.mcus, [this](McuId id) {
    const Mcu& mcu = installation_[id];
    if (!installation_.rests(mcu)) return false;
    return mcu.offline() || (mcu.online() && !mcu.busy());
  });
}

void TablesInService::begin_upload(std::int64_t now_us, Change& change) {
  for (Part& part : change.parts) {
    part.before = installation_.tables()[part.group];
    installation_.put_in_service(part.group, part.table);
  }
  change.deadline_us = now_us + kConfirmUs;
  std::string absent;
  for (const McuId id : change.mcus) {
    Mcu& mcu = installation_[id];
    mcu.bus().reconfigure(mcu.on_bus(), installation_.setup_of(id));
    if (mcu.offline()) {
      absent += " " + mcu.name();
    } else {
      change.awaited.push_back(id);
      change.deadline_us += upload_us(mcu);
    }
  }
  if (!absent.empty()) {
    add_sentence(change.notes, "not online, they get it when they come:" + absent);
  }
  change.stage = Change::Stage::kUploading;
  installation_.changed = true;
}

std::int64_t TablesInService::upload_us(const Mcu& mcu) const {
  if (!mcu.offers.streams) return 0;  // nothing is sent
  std::size_t requests = 0;
  const link::McuSetup setup = installation_.setup_of(mcu.id);
  for (const link::TableRef& ref : setup.tables) {
    const std::size_t codes = ref.table->accel.count + ref.table->decel.count;
    requests += kRequestsPerTable + codes / BUSHD_TABLE_DATA_MAX_CODES;
  }
  const auto line_us =
      static_cast<std::int64_t>(kRequestBytes * 10'000'000 / installation_.bus_of(mcu).config.baud);
  return static_cast<std::int64_t>(requests) * (kRequestUs + line_us);
}

bool TablesInService::uploaded(const Change& change) const {
  return std::ranges::all_of(change.awaited, [this](McuId id) {
    return installation_[id].online() && !installation_[id].busy();
  });
}

void TablesInService::roll_back(Change& change) {
  std::string who;
  for (const McuId id : change.awaited) {
    const Mcu& mcu = installation_[id];
    if (mcu.online()) continue;
    add_sentence(who, "MCU " + mcu.name() + " did not confirm it in time: " + mcu.view().detail);
  }
  for (const Part& part : change.parts) {
    installation_.put_in_service(part.group, part.before);
    add_sentence(who, "group " + name_of(part.group) + " keeps " + text_of(*part.before));
  }
  for (const McuId id : mcus_of(change.parts)) {
    installation_[id].bus().reconfigure(installation_[id].on_bus(), installation_.setup_of(id));
  }
  change.notes = who;
}

void TablesInService::keep(Changes::iterator change) {
  if (!change->kept) return finish(change, {});
  change->stage = Change::Stage::kKeeping;
  for (const Part& part : change->parts) wanted_[part.group] = part.wanted;
  outputs_.keep_tables(change->ticket, {wanted_.begin(), wanted_.end()});
}

void TablesInService::step(std::int64_t now_us) {
  for (auto it = changes_.begin(); it != changes_.end();) {
    const auto change = it++;
    if (change->stage == Change::Stage::kResting && ready(*change)) {
      // Other changes may have come before, or MCUs with less memory.
      if (const auto good = fits(change->parts); !good) {
        complete(change, api::Outcome::kFault, good.error().text());
        continue;
      }
      begin_upload(now_us, *change);
    }
    if (change->stage != Change::Stage::kUploading) continue;
    if (uploaded(*change)) {
      keep(change);
    } else if (now_us > change->deadline_us) {
      roll_back(*change);
      complete(change, api::Outcome::kFault, change->notes);
    }
  }
}

void TablesInService::kept(std::uint64_t ticket, const Result<void>& kept) {
  const auto change = find(ticket);
  if (change != changes_.end()) finish(change, kept);
}

void TablesInService::finish(Changes::iterator change, const Result<void>& kept) {
  std::string text;
  for (const Part& part : change->parts) {
    const tables::Table& table = *installation_.tables()[part.group];
    add_sentence(text, "group " + name_of(part.group) + " has " + text_of(table));
  }
  if (!change->notes.empty()) add_sentence(text, change->notes);
  if (!kept) add_sentence(text, "a restart of the daemon will not know it: " + kept.error().text());
  if (!change->refused.empty()) add_sentence(text, change->refused);
  complete(change, change->refused.empty() ? api::Outcome::kDone : api::Outcome::kFault, text);
}

void TablesInService::refuse(Changes::iterator change) {
  const Change finished = std::move(*change);
  changes_.erase(change);
  if (!finished.asker.session) outputs_.log(LogLevel::kError, {}, "tables: " + finished.refused);
  finished.asker.answer(api::Refused{finished.refused});
}

void TablesInService::complete(Changes::iterator change, api::Outcome outcome,
                               const std::string& reason) {
  const std::string text = reason;  // which may be the change's own
  const Change finished = std::move(*change);
  changes_.erase(change);
  installation_.changed = true;
  outputs_.log(outcome == api::Outcome::kDone ? LogLevel::kInfo : LogLevel::kError, {},
               "tables: " + text);
  finished.asker.answer(api::Completed{.outcome = outcome, .reason = text, .detail = {}});
}

Result<void> TablesInService::check_content(const std::string& name,
                                            const TableReview& review) const {
  Tables tables = installation_.tables();
  for (const GroupId group : wanted_.ids()) {
    if (wanted_[group] == name) tables[group] = review.table;
  }
  for (const GroupId group : wanted_.ids()) {
    if (wanted_[group] != name) continue;
    if (const auto good = fits(tables, group, &review); !good) {
      return fail("group " + name_of(group) + " has it, and " + good.error().text());
    }
  }
  return {};
}

Result<void> TablesInService::restore(GroupId group, const std::string& wanted,
                                      tables::TablePtr table) {
  table = shared(installation_.tables(), std::move(table));
  Tables tables = installation_.tables();
  tables[group] = table;
  if (auto good = fits(tables, group); !good) return good;
  installation_.put_in_service(group, table);
  wanted_[group] = wanted;
  for (const McuId id : installation_.mcus()) {
    installation_[id].bus().reconfigure(installation_[id].on_bus(), installation_.setup_of(id));
  }
  outputs_.log(LogLevel::kInfo, {},
               "group " + name_of(group) + " has table " + wanted + ", " + text_of(*table) +
                   ", as it was given; configured is " + installation_.config()[group].table_name);
  return {};
}

}  // namespace bushd::daemon
