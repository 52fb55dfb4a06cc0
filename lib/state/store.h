// The state store: a folder with the database of positions (state.db) and the file of moving marks
// (moving.marks). mark() may be called in one thread, everything else in another.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "state/database.h"
#include "state/disk.h"
#include "state/marks.h"
#include "state/record.h"

namespace bushd::state {

struct Opening {
  std::filesystem::path folder{};
  std::vector<std::string> motors{};  // that may move
  // Motors may move though their marks cannot be written: if this daemon does not say in the end
  // that none had to (end), no position is taken to be that of a motor at rest.
  bool unguarded = false;
  std::int64_t utime_us = 0;
  std::uint64_t random = 0;  // names a new file of marks
};

class Store {
 public:
  // Makes what is not there. Takes some syncs of the disk.
  static Result<Store> open(Disk& disk, const Opening& opening);

  // What was kept of the motors when it was opened.
  const std::map<std::string, Kept>& kept() const { return kept_; }
  // What people should know of what was found.
  const std::vector<std::string>& notes() const { return notes_; }

  Result<void> mark(const std::vector<Mark>& marks) { return marks_->write(marks); }
  Result<void> write(const Batch& batch) { return database_.write(batch); }
  Result<std::vector<PastMove>> history(const std::string& motor, int most) {
    return database_.history(motor, most);
  }
  // No motor has moved without its mark, and none will.
  Result<void> end() { return database_.set_unguarded(false); }

 private:
  explicit Store(Database database) : database_(std::move(database)) {}
  Result<void> read_marks(Disk& disk, const Opening& opening);

  Database database_;
  std::optional<Marks> marks_;  // always there once it is open
  std::map<std::string, Kept> kept_;
  std::vector<std::string> notes_;
};

}  // namespace bushd::state
