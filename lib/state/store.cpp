#include "state/store.h"

#include <algorithm>
#include <set>
#include <utility>

#include "state/rules.h"

namespace bushd::state {
namespace {

constexpr const char* kRecordLost =
    "its kept position was lost with the database of the state store";

std::string held_since(std::int64_t utime_us) {
  return "by bushd since " + time_text(utime_us) +
         ", because state.db, which lists holds, was damaged or missing";
}

// What the slots of the database's own file say; others say nothing.
std::map<std::string, std::uint64_t> motions_of(const Marks::Content& found,
                                                const std::vector<std::string>& slots) {
  std::map<std::string, std::uint64_t> motions;
  for (std::size_t i = 0; i < slots.size() && i < found.slots.size(); ++i) {
    const auto& mark = found.slots[i];
    if (mark && mark->motor == slots[i]) motions[mark->motor] = mark->motion;
  }
  return motions;
}

}  // namespace

Result<Store> Store::open(Disk& disk, const Opening& opening) {
  if (auto made = disk.make_folder(opening.folder); !made) return fail(made.error());
  std::vector<std::string> notes;
  auto database = Database::open(disk, opening.folder / "state.db", opening.utime_us, notes);
  if (!database) return fail(database.error());
  Store store(std::move(*database));
  store.notes_ = std::move(notes);
  const auto ended = store.database_.end_unguarded();
  if (!ended) return fail(ended.error());
  if (*ended) {
    store.notes_.push_back(
        "the daemon before ran with [state] required = false and was not ended in an orderly way; "
        "motors whose MCUs restart are uncertain");
  }
  if (auto read = store.read_marks(disk, opening); !read) return fail(read.error());
  if (opening.unguarded) {
    if (auto set = store.database_.set_unguarded(true); !set) return fail(set.error());
  }
  return store;
}

Result<void> Store::read_marks(Disk& disk, const Opening& opening) {
  auto slots = database_.slots();
  if (!slots) return fail(slots.error());
  const auto own_id = database_.marks_id();
  if (!own_id) return fail(own_id.error());
  const auto records = database_.records();
  if (!records) return fail(records.error());
  auto settings = database_.settings();
  if (!settings) return fail(settings.error());

  const std::filesystem::path path = opening.folder / "moving.marks";
  auto file = disk.open(path);
  if (!file) return fail(file.error());
  const auto found = Marks::read(**file);
  if (!found) return fail(found.error());
  const bool own = *own_id != 0 && found->id == *own_id;
  const auto motions = own ? motions_of(*found, *slots) : std::map<std::string, std::uint64_t>();
  if (!own && !records->empty()) {
    notes_.push_back(path.string() +
                     ": is not the file that belongs to state.db; motors whose "
                     "MCUs restart are uncertain");
  }

  // Motors of which a file of marks knows and the database does not: it is not the one it was.
  std::map<std::string, std::uint64_t> lost;
  for (const auto& mark : found->slots) {
    const bool known = mark && std::ranges::find(*slots, mark->motor) != slots->end();
    if (mark && !known) lost[mark->motor] = std::max(lost[mark->motor], mark->motion);
  }
  std::vector<std::string> added;
  Batch of_lost;
  for (const std::string& motor : opening.motors) {
    if (std::ranges::find(*slots, motor) != slots->end()) continue;
    added.push_back(motor);
    if (!lost.contains(motor) && !database_.begun_anew()) continue;
    of_lost.records[motor] = {.trust = Trust::kUncertain, .reason = kRecordLost};
    // Whether it was held nobody knows: it is the reading that moves less.
    (*settings)[motor][kHeldKey].value = held_since(opening.utime_us);
    of_lost.settings[motor] = (*settings)[motor];
  }
  const std::uint64_t id = own ? *own_id : std::max<std::uint64_t>(opening.random >> 1, 1);
  if (!own || !added.empty()) {
    if (auto done = database_.add_slots(id, added, of_lost); !done) return done;
  }
  slots->insert(slots->end(), added.begin(), added.end());

  std::vector<Mark> marks;
  for (const std::string& motor : *slots) {
    Kept& kept = kept_[motor];
    if (const auto record = records->find(motor); record != records->end()) {
      kept.record = record->second;
    } else if (const auto begun = of_lost.records.find(motor); begun != of_lost.records.end()) {
      kept.record = begun->second;
    }
    kept.settings = std::move((*settings)[motor]);
    if (const auto motion = motions.find(motor); motion != motions.end()) {
      kept.motion = motion->second;
    } else if (kept.record) {
      kept.mark_lost = true;
      kept.motion = std::max(kept.record->motion, lost[motor]) + 1;
    }
    marks.push_back({.motor = motor, .motion = kept.motion});
  }
  for (auto& [name, of_name] : *settings) {
    if (is_no_motor(name)) kept_[name].settings = std::move(of_name);
  }
  auto made = Marks::make(std::move(*file), id, marks);
  if (!made) return fail(made.error());
  marks_ = std::move(*made);
  return disk.sync_folder(opening.folder);
}

}  // namespace bushd::state
