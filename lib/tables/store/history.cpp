#include "tables/store/history.h"

#include <sqlite3.h>

#include <system_error>
#include <utility>

namespace bushd::tables::store {
namespace {

constexpr int kBusyTimeoutMs = 10'000;

constexpr const char* kSchema = R"(
CREATE TABLE IF NOT EXISTS revision (
  name TEXT NOT NULL,
  number INTEGER NOT NULL,
  time TEXT NOT NULL,
  note TEXT NOT NULL,
  content_hash TEXT NOT NULL,
  text TEXT NOT NULL,
  PRIMARY KEY (name, number)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS tag (
  name TEXT NOT NULL,
  tag TEXT NOT NULL,
  number INTEGER NOT NULL,
  PRIMARY KEY (name, tag)) WITHOUT ROWID;
)";

// Later than the others: a history may be there without it, and be readable only.
constexpr const char* kPendingSchema = R"(
CREATE TABLE IF NOT EXISTS pending (
  name TEXT NOT NULL PRIMARY KEY,
  number INTEGER NOT NULL,
  time TEXT NOT NULL,
  note TEXT NOT NULL,
  content_hash TEXT NOT NULL,
  text TEXT NOT NULL) WITHOUT ROWID;
)";

class Statement {
 public:
  Statement(sqlite3* database, const char* sql) {
    sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(const std::string& text) {
    sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  Statement& bind(std::uint32_t number) {
    sqlite3_bind_int64(statement_, ++bound_, number);
    return *this;
  }

  bool is_prepared() const { return statement_ != nullptr; }
  // SQLITE_ROW, SQLITE_DONE or an error; a statement that could not be prepared is an error too.
  int step() { return statement_ == nullptr ? SQLITE_ERROR : sqlite3_step(statement_); }

  std::uint32_t number(int column) const {
    return static_cast<std::uint32_t>(sqlite3_column_int64(statement_, column));
  }
  std::string text(int column) const {
    const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return bytes == nullptr ? std::string() : std::string(bytes, size);
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

}  // namespace

void History::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

tl::unexpected<Error> History::failed() const {
  return fail(Error{.message = std::string("the history of tables: ") +
                               sqlite3_errmsg(database_.get()) + ". Another place: --history FILE",
                    .file = path_});
}

Result<History> History::open(const std::filesystem::path& path) {
  std::error_code ignored;  // opening tells
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), ignored);
  sqlite3* database = nullptr;
  const int opened = sqlite3_open(path.c_str(), &database);
  History history(std::unique_ptr<sqlite3, Close>(database), path.string());
  if (opened != SQLITE_OK) return history.failed();
  sqlite3_busy_timeout(database, kBusyTimeoutMs);
  if (auto made = history.run(kSchema); !made) return fail(made.error());
  if (auto made = history.run(kPendingSchema); !made) {
    if (sqlite3_errcode(database) != SQLITE_READONLY) return fail(made.error());
  }
  return history;
}

Result<void> History::run(const char* sql) {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return failed();
}

Result<void> History::begin() {
  return run("BEGIN IMMEDIATE");
}

Result<void> History::commit() {
  return run("COMMIT");
}

void History::roll_back() {
  (void)run("ROLLBACK");
}

Result<void> History::insert(const std::string& into, const std::string& table,
                             const Revision& revision, const std::string& text) {
  const std::string sql = into +
                          " (name, number, time, note, content_hash, text)"
                          " VALUES (?, ?, strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), ?, ?, ?)";
  Statement insert(database_.get(), sql.c_str());
  insert.bind(table)
      .bind(revision.number)
      .bind(revision.note)
      .bind(revision.content_hash)
      .bind(text);
  if (insert.step() != SQLITE_DONE) return failed();
  return {};
}

Result<void> History::add(const std::string& table, const Revision& revision,
                          const std::string& text) {
  return insert("INSERT INTO revision", table, revision, text);
}

Result<std::uint32_t> History::last(const std::string& table) const {
  Statement select(database_.get(), "SELECT coalesce(max(number), 0) FROM revision WHERE name = ?");
  select.bind(table);
  if (select.step() != SQLITE_ROW) return failed();
  return select.number(0);
}

Result<std::optional<std::string>> History::text(const std::string& table,
                                                 std::uint32_t revision) const {
  Statement select(database_.get(), "SELECT text FROM revision WHERE name = ? AND number = ?");
  const int row = select.bind(table).bind(revision).step();
  if (row == SQLITE_ROW) return select.text(0);
  if (row == SQLITE_DONE) return std::nullopt;
  return failed();
}

Result<std::vector<Revision>> History::log(const std::string& table) const {
  Statement select(database_.get(),
                   "SELECT number, time, note, content_hash FROM revision WHERE name = ?"
                   " ORDER BY number DESC");
  select.bind(table);
  std::vector<Revision> log;
  int row = select.step();
  for (; row == SQLITE_ROW; row = select.step()) {
    log.push_back({.number = select.number(0),
                   .time = select.text(1),
                   .note = select.text(2),
                   .content_hash = select.text(3)});
  }
  if (row != SQLITE_DONE) return failed();
  Statement tags(database_.get(), "SELECT number, tag FROM tag WHERE name = ? ORDER BY tag");
  tags.bind(table);
  for (row = tags.step(); row == SQLITE_ROW; row = tags.step()) {
    for (Revision& revision : log) {
      if (revision.number == tags.number(0)) revision.tags.push_back(tags.text(1));
    }
  }
  if (row != SQLITE_DONE) return failed();
  return log;
}

Result<void> History::announce(const std::string& table, const Revision& revision,
                               const std::string& text) {
  return insert("INSERT OR REPLACE INTO pending", table, revision, text);
}

Result<std::optional<History::Pending>> History::announced(const std::string& table) const {
  Statement select(database_.get(),
                   "SELECT number, time, note, content_hash, text FROM pending WHERE name = ?");
  if (!select.is_prepared()) return std::nullopt;  // of a time before there were such
  const int row = select.bind(table).step();
  if (row == SQLITE_DONE) return std::nullopt;
  if (row != SQLITE_ROW) return failed();
  return Pending{.revision = {.number = select.number(0),
                              .time = select.text(1),
                              .note = select.text(2),
                              .content_hash = select.text(3)},
                 .text = select.text(4)};
}

Result<void> History::confirm(const std::string& table) {
  Statement insert(database_.get(),
                   "INSERT OR REPLACE INTO revision (name, number, time, note, content_hash, text)"
                   " SELECT name, number, time, note, content_hash, text FROM pending"
                   " WHERE name = ?");
  if (insert.bind(table).step() != SQLITE_DONE) return failed();
  return withdraw(table);
}

Result<void> History::withdraw(const std::string& table) {
  Statement remove(database_.get(), "DELETE FROM pending WHERE name = ?");
  if (remove.bind(table).step() != SQLITE_DONE) return failed();
  return {};
}

Result<void> History::tag(const std::string& table, const std::string& tag,
                          std::uint32_t revision) {
  Statement insert(database_.get(),
                   "INSERT OR REPLACE INTO tag (name, tag, number) VALUES (?, ?, ?)");
  if (insert.bind(table).bind(tag).bind(revision).step() != SQLITE_DONE) return failed();
  return {};
}

Result<std::optional<std::uint32_t>> History::tagged(const std::string& table,
                                                     const std::string& tag) const {
  Statement select(database_.get(), "SELECT number FROM tag WHERE name = ? AND tag = ?");
  const int row = select.bind(table).bind(tag).step();
  if (row == SQLITE_ROW) return select.number(0);
  if (row == SQLITE_DONE) return std::nullopt;
  return failed();
}

}  // namespace bushd::tables::store
