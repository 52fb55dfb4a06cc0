#include "state/database.h"

#include <array>
#include <utility>

#include "state/rules.h"

namespace bushd::state {
namespace {

constexpr std::int64_t kApplicationId = 0x62757368;  // "bush"

constexpr const char* kVersion1 = R"(
CREATE TABLE file (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  marks_id INTEGER NOT NULL,
  unguarded INTEGER NOT NULL) STRICT;
INSERT INTO file (id, marks_id, unguarded) VALUES (1, 0, 0);
CREATE TABLE slot (
  motor TEXT NOT NULL UNIQUE,
  slot INTEGER PRIMARY KEY) STRICT;
CREATE TABLE position (
  motor TEXT NOT NULL PRIMARY KEY,
  steps INTEGER NOT NULL,
  steps_per_unit TEXT NOT NULL,
  trust TEXT NOT NULL CHECK (trust IN ('unconfirmed', 'known', 'restored', 'uncertain')),
  reason TEXT NOT NULL,
  utime_us INTEGER NOT NULL,
  unique_id TEXT NOT NULL,
  boot_number INTEGER NOT NULL,
  output INTEGER NOT NULL,
  at_rest INTEGER NOT NULL,
  motion INTEGER NOT NULL) STRICT;
CREATE TABLE setting (
  motor TEXT NOT NULL,
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  replaces TEXT NOT NULL,
  PRIMARY KEY (motor, key)) STRICT;
CREATE TABLE move (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  motor TEXT NOT NULL,
  utime_us INTEGER NOT NULL,
  what TEXT NOT NULL,
  who TEXT NOT NULL,
  from_steps INTEGER NOT NULL,
  to_steps INTEGER NOT NULL,
  result TEXT NOT NULL,
  reason TEXT NOT NULL) STRICT;
CREATE INDEX move_of_motor ON move (motor, id);
CREATE INDEX move_by_time ON move (utime_us);
)";

constexpr const char* kVersion2 = R"(
ALTER TABLE move ADD COLUMN from_text TEXT NOT NULL DEFAULT '';
ALTER TABLE move ADD COLUMN to_text TEXT NOT NULL DEFAULT '';
)";

// An output is one motor's at a time: that which was written last.
constexpr const char* kVersion3 = R"(
UPDATE position SET unique_id = '', at_rest = 0, trust = 'uncertain',
  reason = CASE trust WHEN 'uncertain' THEN reason
    ELSE 'its output has become that of another motor; last known: ' || steps || ' steps' END
  WHERE unique_id <> '' AND EXISTS (SELECT 1 FROM position AS newer
    WHERE newer.unique_id = position.unique_id AND newer.output = position.output
      AND newer.rowid > position.rowid);
)";

constexpr const char* kVersion4 = R"(
ALTER TABLE position ADD COLUMN target_steps INTEGER NOT NULL DEFAULT 0;
ALTER TABLE position ADD COLUMN target_parts INTEGER NOT NULL DEFAULT 0;
)";

constexpr std::array kVersions = {kVersion1, kVersion2, kVersion3, kVersion4};
constexpr std::array kTrust = {"unconfirmed", "known", "restored", "uncertain"};

Trust trust_of(const std::string& word) {
  for (std::size_t i = 0; i < kTrust.size(); ++i) {
    if (word == kTrust[i]) return static_cast<Trust>(i);
  }
  return Trust::kUncertain;
}

// "20261120T170312"
std::string file_time(std::int64_t utime_us) {
  std::string text;
  for (const char c : time_text(utime_us)) {
    if (c >= '0' && c <= '9') text += c;
    if (c == ' ' && text.size() == 8) text += 'T';
  }
  return text;
}

Result<void> move_aside(Disk& disk, const std::filesystem::path& path, std::int64_t utime_us,
                        const std::string& why, std::vector<std::string>& notes) {
  std::filesystem::path to;
  for (int n = 1; to.empty() || disk.exists(to); ++n) {
    to =
        path.string() + ".damaged-" + file_time(utime_us) + (n == 1 ? "" : "-" + std::to_string(n));
  }
  // The log first: were it left alone for a moment, the next database would get it.
  for (const char* part : {"-wal", "-shm", ""}) {
    const std::filesystem::path from = path.string() + part;
    if (!disk.exists(from)) continue;
    if (auto moved = disk.rename(from, to.string() + part); !moved) return moved;
  }
  if (auto synced = disk.sync_folder(path.parent_path()); !synced) return synced;
  notes.push_back(path.string() + ": " + why + "; it is kept as " + to.string() +
                  ", and positions begin anew: check them, and set, home or confirm the motors");
  return {};
}

}  // namespace

Versions all_versions() {
  return kVersions;
}

Result<Database> Database::open(Disk& disk, const std::filesystem::path& path,
                                std::int64_t utime_us, std::vector<std::string>& notes,
                                Versions versions) {
  auto opened = open_once(disk, path, notes, versions);
  if (opened) return std::move(*opened);
  if (opened.error().is_ours) return fail(opened.error().error);
  const std::string why = opened.error().error.message;
  if (auto moved = move_aside(disk, path, utime_us, why, notes); !moved) return fail(moved.error());
  auto anew = open_once(disk, path, notes, versions);
  if (!anew) return fail(anew.error().error);
  anew->begun_anew_ = true;
  return std::move(*anew);
}

tl::expected<Database, Database::Refusal> Database::open_once(Disk& disk,
                                                              const std::filesystem::path& path,
                                                              std::vector<std::string>& notes,
                                                              Versions versions) {
  auto sqlite = Sqlite::open(path.string(), disk.vfs());
  if (!sqlite) return tl::unexpected<Refusal>(Refusal{sqlite.error(), true});
  Database database(std::move(*sqlite));
  auto ready = database.set_up(path);
  if (ready) ready = database.bring_up_to_date(disk, path, notes, versions);
  if (ready) ready = database.probe();
  if (ready) return database;
  const bool is_ours = !database.foreign_ && !database.sqlite_.damaged();
  return tl::unexpected<Refusal>(Refusal{ready.error(), is_ours});
}

Result<void> Database::set_up(const std::filesystem::path& path) {
  // Exclusive before WAL: no shared memory is needed, and nobody else can come in between.
  if (auto set = sqlite_.run("PRAGMA locking_mode = EXCLUSIVE"); !set) return set;
  const auto tables = sqlite_.number("SELECT count(*) FROM sqlite_schema");
  if (!tables) return fail(tables.error());
  const auto application = sqlite_.number("PRAGMA application_id");
  if (!application) return fail(application.error());
  if (*tables > 0 && *application != kApplicationId) {
    foreign_ = true;
    return fail(Error{.message = "is no database of bushd", .file = path});
  }
  auto set = sqlite_.run(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA trusted_schema = OFF;"
      "BEGIN IMMEDIATE; COMMIT");
  if (!set) return set;
  const auto check = sqlite_.text("PRAGMA quick_check(1)");
  if (!check) return fail(check.error());
  if (*check == "ok") return {};
  foreign_ = true;
  return fail(Error{.message = "is damaged (" + *check + ")", .file = path});
}

Result<void> Database::bring_up_to_date(Disk& disk, const std::filesystem::path& path,
                                        std::vector<std::string>& notes, Versions versions) {
  const auto version = sqlite_.number("PRAGMA user_version");
  if (!version) return fail(version.error());
  const auto newest = static_cast<std::int64_t>(versions.size());
  if (*version == newest) return {};
  if (*version > newest || *version < 0) {
    return fail(Error{.message = "is of version " + std::to_string(*version) +
                                 ", made by a newer bushd; this one knows versions up to " +
                                 std::to_string(newest),
                      .file = path});
  }
  if (*version > 0) {
    const std::string copy = path.string() + ".version-" + std::to_string(*version);
    if (auto copied = copy_to(disk, copy); !copied) return copied;
    notes.push_back(path.string() + ": brought from version " + std::to_string(*version) + " to " +
                    std::to_string(newest) + "; as it was it is kept as " + copy);
  }
  return transact([&]() -> Result<void> {
    for (std::int64_t i = *version; i < newest; ++i) {
      if (auto made = sqlite_.run(versions[static_cast<std::size_t>(i)]); !made) return made;
    }
    return sqlite_.run("PRAGMA application_id = " + std::to_string(kApplicationId) +
                       "; PRAGMA user_version = " + std::to_string(newest));
  });
}

// Under another name until it is whole.
Result<void> Database::copy_to(Disk& disk, const std::filesystem::path& copy) {
  const std::string part = copy.string() + ".part";
  if (disk.exists(part)) {
    if (auto removed = disk.remove(part); !removed) return removed;
  }
  Statement vacuum(sqlite_, "VACUUM INTO ?");
  if (auto copied = vacuum.bind(part).run(); !copied) return copied;
  const auto file = disk.open(part);
  if (!file) return fail(file.error());
  if (auto synced = (*file)->sync(); !synced) return synced;
  if (auto named = disk.rename(part, copy); !named) return named;
  return disk.sync_folder(copy.parent_path());
}

Result<void> Database::probe() {
  auto probed = sqlite_.run(
      "SELECT (SELECT marks_id + unguarded FROM file), (SELECT motor || slot FROM slot),"
      " (SELECT motor || steps || steps_per_unit || trust || reason || utime_us || unique_id ||"
      " boot_number || output || at_rest || motion FROM position),"
      " (SELECT motor || key || value || replaces FROM setting),"
      " (SELECT id || motor || utime_us || what || who || from_steps || to_steps || result || "
      "reason"
      " FROM move)");
  foreign_ = !probed && sqlite_.lacks_table();
  return probed;
}

template <class Work>
Result<void> Database::transact(const Work& work) {
  if (auto begun = sqlite_.run("BEGIN IMMEDIATE"); !begun) return begun;
  Result<void> done = work();
  if (done) done = sqlite_.run("COMMIT");
  if (!done) (void)sqlite_.run("ROLLBACK");
  return done;
}

Result<std::uint64_t> Database::marks_id() {
  const auto id = sqlite_.number("SELECT marks_id FROM file");
  if (!id) return fail(id.error());
  return static_cast<std::uint64_t>(*id);
}

Result<std::vector<std::string>> Database::slots() {
  Statement select(sqlite_, "SELECT motor FROM slot ORDER BY slot");
  std::vector<std::string> slots;
  const auto read = select.each([&] { slots.push_back(select.text(0)); });
  if (!read) return fail(read.error());
  return slots;
}

Result<void> Database::add_slots(std::uint64_t marks_id, const std::vector<std::string>& motors,
                                 const Batch& of_motors) {
  return transact([&]() -> Result<void> {
    Statement file(sqlite_, "UPDATE file SET marks_id = ?");
    if (auto set = file.bind(static_cast<std::int64_t>(marks_id)).run(); !set) return set;
    Statement insert(sqlite_,
                     "INSERT INTO slot (motor, slot)"
                     " VALUES (?, (SELECT coalesce(max(slot) + 1, 0) FROM slot))");
    for (const std::string& motor : motors) {
      if (auto added = insert.bind(motor).run(); !added) return added;
    }
    return put(of_motors);
  });
}

Result<void> Database::set_unguarded(bool unguarded) {
  return sqlite_.run("UPDATE file SET unguarded = " + std::string(unguarded ? "1" : "0"));
}

Result<bool> Database::end_unguarded() {
  const auto unguarded = sqlite_.number("SELECT unguarded FROM file");
  if (!unguarded) return fail(unguarded.error());
  if (*unguarded == 0) return false;
  const auto ended = transact([&] {
    return sqlite_.run("UPDATE position SET at_rest = 0; UPDATE file SET unguarded = 0");
  });
  if (!ended) return fail(ended.error());
  return true;
}

Result<std::map<std::string, Record>> Database::records() {
  Statement select(sqlite_,
                   "SELECT motor, steps, steps_per_unit, trust, reason, utime_us, unique_id,"
                   " boot_number, output, at_rest, motion, target_steps, target_parts"
                   " FROM position");
  std::map<std::string, Record> records;
  const auto read = select.each([&] {
    records[select.text(0)] = {.steps = select.number(1),
                               .steps_per_unit = select.text(2),
                               .trust = trust_of(select.text(3)),
                               .reason = select.text(4),
                               .utime_us = select.number(5),
                               .target_steps = select.number(11),
                               .target_parts = select.number(12),
                               .unique_id = select.text(6),
                               .boot_number = static_cast<std::uint16_t>(select.number(7)),
                               .output = static_cast<std::uint8_t>(select.number(8)),
                               .at_rest = select.number(9) != 0,
                               .motion = static_cast<std::uint64_t>(select.number(10))};
  });
  if (!read) return fail(read.error());
  return records;
}

Result<std::map<std::string, Settings>> Database::settings() {
  Statement select(sqlite_, "SELECT motor, key, value, replaces FROM setting");
  std::map<std::string, Settings> settings;
  const auto read = select.each([&] {
    settings[select.text(0)][select.text(1)] = {.value = select.text(2),
                                                .replaces = select.text(3)};
  });
  if (!read) return fail(read.error());
  return settings;
}

Result<std::vector<PastMove>> Database::history(const std::string& motor, int most) {
  Statement select(sqlite_,
                   "SELECT motor, utime_us, what, who, from_steps, to_steps, result, reason,"
                   " from_text, to_text FROM move WHERE motor = ? ORDER BY id DESC LIMIT ?");
  select.bind(motor).bind(std::int64_t{most});
  std::vector<PastMove> moves;
  const auto read = select.each([&] {
    moves.push_back({.motor = select.text(0),
                     .utime_us = select.number(1),
                     .what = select.text(2),
                     .who = select.text(3),
                     .from_steps = select.number(4),
                     .to_steps = select.number(5),
                     .result = select.text(6),
                     .reason = select.text(7),
                     .from_text = select.text(8),
                     .to_text = select.text(9)});
  });
  if (!read) return fail(read.error());
  return moves;
}

Result<void> Database::write(const Batch& batch) {
  return transact([&] { return put(batch); });
}

Result<void> Database::put(const Batch& batch) {
  for (const auto& [motor, record] : batch.records) {
    if (auto done = put(motor, record); !done) return done;
  }
  for (const auto& [motor, settings] : batch.settings) {
    if (auto done = put(motor, settings); !done) return done;
  }
  for (const PastMove& move : batch.moves) {
    if (auto done = add(move); !done) return done;
  }
  return {};
}

Result<void> Database::put(const std::string& motor, const Record& record) {
  Statement insert(sqlite_,
                   "INSERT OR REPLACE INTO position (motor, steps, steps_per_unit, trust, reason,"
                   " utime_us, unique_id, boot_number, output, at_rest, motion, target_steps,"
                   " target_parts) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  return insert.bind(motor)
      .bind(record.steps)
      .bind(record.steps_per_unit)
      .bind(std::string(kTrust[static_cast<std::size_t>(record.trust)]))
      .bind(record.reason)
      .bind(record.utime_us)
      .bind(record.unique_id)
      .bind(std::int64_t{record.boot_number})
      .bind(std::int64_t{record.output})
      .bind(std::int64_t{record.at_rest})
      .bind(static_cast<std::int64_t>(record.motion))
      .bind(record.target_steps)
      .bind(record.target_parts)
      .run();
}

Result<void> Database::put(const std::string& motor, const Settings& settings) {
  Statement remove(sqlite_, "DELETE FROM setting WHERE motor = ?");
  if (auto removed = remove.bind(motor).run(); !removed) return removed;
  Statement insert(sqlite_,
                   "INSERT INTO setting (motor, key, value, replaces) VALUES (?, ?, ?, ?)");
  for (const auto& [key, setting] : settings) {
    auto added = insert.bind(motor).bind(key).bind(setting.value).bind(setting.replaces).run();
    if (!added) return added;
  }
  return {};
}

Result<void> Database::add(const PastMove& move) {
  Statement insert(sqlite_,
                   "INSERT INTO move (motor, utime_us, what, who, from_steps, to_steps, result,"
                   " reason, from_text, to_text) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  auto added = insert.bind(move.motor)
                   .bind(move.utime_us)
                   .bind(move.what)
                   .bind(move.who)
                   .bind(move.from_steps)
                   .bind(move.to_steps)
                   .bind(move.result)
                   .bind(move.reason)
                   .bind(move.from_text)
                   .bind(move.to_text)
                   .run();
  if (!added) return added;
  if (auto removed = remove_old_moves(); !removed) return removed;
  Statement many(sqlite_,
                 "DELETE FROM move WHERE motor = ?1 AND id <="
                 " (SELECT id FROM move WHERE motor = ?1 ORDER BY id DESC LIMIT 1 OFFSET ?2)");
  return many.bind(move.motor).bind(std::int64_t{kHistoryMoves}).run();
}

Result<void> Database::remove_old_moves() {
  const auto newest = sqlite_.number("SELECT max(id) FROM move");
  if (!newest) return fail(newest.error());
  if (*newest % kLookEvery != 0) return {};
  Statement old(sqlite_,
                "DELETE FROM move WHERE id <= (SELECT max(id) FROM"
                " (SELECT id, sum(gap_us) OVER (ORDER BY id DESC) AS age_us FROM"
                " (SELECT id, max(0, min(?1, lead(utime_us, 1, utime_us) OVER (ORDER BY id)"
                " - utime_us)) AS gap_us FROM move)) WHERE age_us > ?2)");
  return old.bind(kDayUs).bind(kHistoryUs).run();
}

}  // namespace bushd::state
