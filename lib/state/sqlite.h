// SQLite, as far as the store uses it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace bushd::state {

class Sqlite {
 public:
  // `vfs` null: the default.
  static Result<Sqlite> open(const std::string& path, const char* vfs);

  Result<void> run(const std::string& sql);
  Result<std::int64_t> number(const std::string& sql);
  Result<std::string> text(const std::string& sql);
  // What went wrong last, with the file.
  tl::unexpected<Error> failed() const;
  // Something that went wrong was the content of the file, not the disk or another process.
  bool damaged() const { return damaged_; }
  // The last thing that went wrong was that there is no such table or column.
  bool lacks_table() const;
  sqlite3* handle() const { return database_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  Sqlite(std::unique_ptr<sqlite3, Close> database, std::string path)
      : database_(std::move(database)), path_(std::move(path)) {}

  std::unique_ptr<sqlite3, Close> database_;
  std::string path_;
  mutable bool damaged_ = false;
};

// One statement; values are bound in their order.
class Statement {
 public:
  Statement(const Sqlite& database, const char* sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(const std::string& text);
  Statement& bind(std::int64_t number);
  // Whether there is a row.
  Result<bool> step();
  // Hands each row to `take`, to the end.
  Result<void> each(const auto& take) {
    while (true) {
      const auto row = step();
      if (!row) return fail(row.error());
      if (!*row) return {};
      take();
    }
  }
  // To the end, without rows.
  Result<void> run();
  // Ready for other values.
  void reset();

  std::int64_t number(int column) const;
  std::string text(int column) const;

 private:
  const Sqlite& database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

}  // namespace bushd::state
