// The database of positions: state.db, SQLite in WAL mode with every commit synced. One process has
// it at a time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "state/disk.h"
#include "state/record.h"
#include "state/sqlite.h"

namespace bushd::state {

// What makes a database of version i - 1 one of version i, for i = 1 and up.
using Versions = std::span<const char* const>;
Versions all_versions();

class Database {
 public:
  // The history. Its age is that of the days on which something was written: from one line to the
  // next a day at most counts, so that a clock that is wrong for a while makes nothing old.
  static constexpr std::int64_t kDayUs = std::int64_t{86400} * 1'000'000;
  static constexpr std::int64_t kHistoryUs = 90 * kDayUs;
  static constexpr int kHistoryMoves = 2000;  // of one motor
  static constexpr int kLookEvery = 64;       // lines: what is too old is looked for

  // Makes it if it is not there. One of an older version is copied, then brought up to date. One
  // that is damaged, or no database of bushd, is moved aside and begun anew. `notes` gets what
  // people should know of that. Errors: the disk; another process has it; a newer bushd has made
  // it. `utime_us` names what is moved aside.
  static Result<Database> open(Disk& disk, const std::filesystem::path& path, std::int64_t utime_us,
                               std::vector<std::string>& notes, Versions versions = all_versions());
  // What was there had to be moved aside when it was opened.
  bool begun_anew() const { return begun_anew_; }

  Result<void> write(const Batch& batch);

  // The file of moving marks that belongs to it; 0: none yet.
  Result<std::uint64_t> marks_id();
  // Whose slots there are, in their order; motors that are new get the next.
  Result<std::vector<std::string>> slots();
  Result<void> add_slots(std::uint64_t marks_id, const std::vector<std::string>& motors,
                         const Batch& of_motors);
  // Motors may move from now on though their marks cannot be written; or not any more.
  Result<void> set_unguarded(bool unguarded);
  // If an earlier daemon has left that behind: no motor is at rest for certain.
  Result<bool> end_unguarded();

  Result<std::map<std::string, Record>> records();
  Result<std::map<std::string, Settings>> settings();
  // The newest first.
  Result<std::vector<PastMove>> history(const std::string& motor, int most);

 private:
  explicit Database(Sqlite sqlite) : sqlite_(std::move(sqlite)) {}
  struct Refusal {
    Error error;
    bool is_ours;  // else it is to be moved aside
  };
  static tl::expected<Database, Refusal> open_once(Disk& disk, const std::filesystem::path& path,
                                                   std::vector<std::string>& notes,
                                                   Versions versions);
  Result<void> set_up(const std::filesystem::path& path);
  Result<void> bring_up_to_date(Disk& disk, const std::filesystem::path& path,
                                std::vector<std::string>& notes, Versions versions);
  Result<void> copy_to(Disk& disk, const std::filesystem::path& copy);
  // It has the tables that it should have.
  Result<void> probe();
  // All of it, or nothing.
  template <class Work>
  Result<void> transact(const Work& work);
  Result<void> put(const Batch& batch);
  Result<void> put(const std::string& motor, const Record& record);
  Result<void> put(const std::string& motor, const Settings& settings);
  Result<void> add(const PastMove& move);
  Result<void> remove_old_moves();

  Sqlite sqlite_;
  bool foreign_ = false;  // no database of bushd, or not as it should be
  bool begun_anew_ = false;
};

}  // namespace bushd::state
