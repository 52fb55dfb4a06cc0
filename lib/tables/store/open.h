// TABLE[@REV]: a table by its name, or a revision of it by number or tag, as bushtab and the daemon
// understand it alike.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables::store {

inline constexpr const char* kMachineTables = "/etc/bushd/tables";

// A directory of table files, and where its history is.
struct Place {
  std::filesystem::path directory{};
  std::filesystem::path history{};
};

// With the history that a directory has by itself: that of the machine for kMachineTables, else a
// file in the directory.
Place place_of(const std::filesystem::path& directory);

struct Found {
  std::filesystem::path path;  // of the table's file, also for a revision that it no longer has
  TableContent content;
};

// From the first place that knows the table.
Result<Found> find(std::string_view table, std::span<const Place> places);
// The same, ready for motors.
Result<TablePtr> open(std::string_view table, std::span<const Place> places);

}  // namespace bushd::tables::store
