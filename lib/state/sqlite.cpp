#include "state/sqlite.h"

#include <sqlite3.h>

#include <utility>

namespace bushd::state {
namespace {

constexpr int kBusyTimeoutMs = 2000;

}  // namespace

void Sqlite::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

Result<Sqlite> Sqlite::open(const std::string& path, const char* vfs) {
  sqlite3* handle = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int opened = sqlite3_open_v2(path.c_str(), &handle, flags, vfs);
  Sqlite database(std::unique_ptr<sqlite3, Close>(handle), path);
  if (opened != SQLITE_OK) return database.failed();
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyTimeoutMs);
  return database;
}

tl::unexpected<Error> Sqlite::failed() const {
  const int code = sqlite3_errcode(database_.get()) & 0xFF;
  if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) damaged_ = true;
  if (code == SQLITE_BUSY) {
    return fail(Error{.message = "is in use by another bushd; give this one a [state] path of its "
                                 "own",
                      .file = path_});
  }
  return fail(Error{.message = sqlite3_errmsg(database_.get()), .file = path_});
}

bool Sqlite::lacks_table() const {
  return (sqlite3_errcode(database_.get()) & 0xFF) == SQLITE_ERROR;
}

Result<void> Sqlite::run(const std::string& sql) {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return failed();
}

Result<std::int64_t> Sqlite::number(const std::string& sql) {
  Statement select(*this, sql.c_str());
  const auto row = select.step();
  if (!row) return fail(row.error());
  return *row ? select.number(0) : 0;
}

Result<std::string> Sqlite::text(const std::string& sql) {
  Statement select(*this, sql.c_str());
  const auto row = select.step();
  if (!row) return fail(row.error());
  return *row ? select.text(0) : std::string();
}

Statement::Statement(const Sqlite& database, const char* sql) : database_(database) {
  sqlite3_prepare_v2(database.handle(), sql, -1, &statement_, nullptr);
}

Statement::~Statement() {
  sqlite3_finalize(statement_);
}

Statement& Statement::bind(const std::string& text) {
  sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()),
                    SQLITE_TRANSIENT);
  return *this;
}

Statement& Statement::bind(std::int64_t number) {
  sqlite3_bind_int64(statement_, ++bound_, number);
  return *this;
}

Result<bool> Statement::step() {
  if (statement_ == nullptr) return database_.failed();
  const int stepped = sqlite3_step(statement_);
  if (stepped == SQLITE_ROW) return true;
  if (stepped == SQLITE_DONE) return false;
  return database_.failed();
}

Result<void> Statement::run() {
  const auto row = step();
  if (!row) return fail(row.error());
  reset();
  return {};
}

void Statement::reset() {
  sqlite3_reset(statement_);
  bound_ = 0;
}

std::int64_t Statement::number(int column) const {
  return sqlite3_column_int64(statement_, column);
}

std::string Statement::text(int column) const {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return bytes == nullptr ? std::string() : std::string(bytes, size);
}

}  // namespace bushd::state
