// Every revision of every table of a directory, in an SQLite database.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

struct sqlite3;

namespace bushd::tables::store {

struct Revision {
  std::uint32_t number = 0;
  std::string time{};  // UTC, ISO 8601
  std::string note{};  // what was done
  std::string content_hash{};
  std::vector<std::string> tags{};
};

class History {
 public:
  // Makes the database, and its directory, if they are not there.
  static Result<History> open(const std::filesystem::path& path);

  // What is written between begin and commit is there at once or not at all; without a commit it
  // is undone.
  Result<void> begin();
  Result<void> commit();
  void roll_back();

  Result<void> add(const std::string& table, const Revision& revision, const std::string& text);
  Result<std::uint32_t> last(const std::string& table) const;  // 0: none
  // The file's text as it was; empty: there is no such revision.
  Result<std::optional<std::string>> text(const std::string& table, std::uint32_t revision) const;
  Result<std::vector<Revision>> log(const std::string& table) const;  // newest first

  // A revision that is about to be put in place: written before the file is, so that whenever a
  // crash comes, the history knows the text. One for each table.
  struct Pending {
    Revision revision;
    std::string text;
  };
  Result<void> announce(const std::string& table, const Revision& revision,
                        const std::string& text);
  Result<std::optional<Pending>> announced(const std::string& table) const;
  // It is in place: a revision like the others.
  Result<void> confirm(const std::string& table);
  // It never came in place.
  Result<void> withdraw(const std::string& table);

  // A tag names one revision; setting it again moves it.
  Result<void> tag(const std::string& table, const std::string& tag, std::uint32_t revision);
  Result<std::optional<std::uint32_t>> tagged(const std::string& table,
                                              const std::string& tag) const;

 private:
  struct Close {
    void operator()(sqlite3* database) const;
  };
  explicit History(std::unique_ptr<sqlite3, Close> database, std::string path)
      : database_(std::move(database)), path_(std::move(path)) {}
  Result<void> run(const char* sql);
  Result<void> insert(const std::string& into, const std::string& table, const Revision& revision,
                      const std::string& text);
  tl::unexpected<Error> failed() const;

  std::unique_ptr<sqlite3, Close> database_;
  std::string path_;
};

}  // namespace bushd::tables::store
