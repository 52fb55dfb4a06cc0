// A directory of table files with their history: every change is a new revision.
//
// A save takes the directory's lock, compares the file with the text that the change was made from,
// announces the new revision in the history, replaces the file atomically, and confirms the
// revision. If a crash comes in between, the next use confirms or withdraws what was announced, by
// what stands in the file. If someone edits the file by other means, the next save first records
// what it finds. So the history never misses a text that a bushtab has put or seen in place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tables/store/history.h"
#include "tables/table.h"

namespace bushd::tables::store {

struct Stored {
  std::string text;  // of the file
  TableContent content;
};

class Store {
 public:
  // `history` is opened when it is first needed.
  Store(std::filesystem::path directory, std::filesystem::path history)
      : directory_(std::move(directory)), history_path_(std::move(history)) {}

  std::filesystem::path path_of(const std::string& name) const {
    return directory_ / (name + ".toml");
  }

  Result<Stored> read(const std::string& name) const;

  // Both return the new revision's number; the file's `revision` is set to it. The text must be
  // a table.
  Result<std::uint32_t> create(const std::string& name, const std::string& text,
                               const std::string& note);
  // `from` is the text that `text` was made from; if the file is another by now, nothing is done.
  Result<std::uint32_t> save(const std::string& name, const std::string& from,
                             const std::string& text, const std::string& note);

  // `at` is a revision's number or a tag. A file that came without its history is the revision that
  // it says.
  Result<Stored> read(const std::string& name, std::string_view at) const;
  Result<std::vector<Revision>> log(const std::string& name) const;
  // `at` empty: the newest revision.
  Result<std::uint32_t> tag(const std::string& name, const std::string& tag, std::string_view at);

 private:
  Result<std::uint32_t> write(const std::string& name, const std::optional<std::string>& from,
                              const std::string& text, const std::string& note);
  Result<std::uint32_t> number_of(const History& history, const std::string& name,
                                  std::string_view at) const;
  std::optional<Stored> without_history(const std::string& name, std::string_view at) const;
  // Ends what a crash has left: an announced revision is confirmed, unless the file is still the
  // one before. Preconditions: the lock is held, in a transaction.
  Result<void> settle(History& history, const std::string& name) const;
  // As settle(), for those who only read: where they may not, nothing is settled.
  void settle_if_allowed(History& history, const std::string& name) const;
  // What stands in the file, if it is a table that the history does not have.
  Result<std::uint32_t> record_found(History& history, const std::string& name) const;

  std::filesystem::path directory_;
  std::filesystem::path history_path_;
};

}  // namespace bushd::tables::store
