#include "tables/store/open.h"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "tables/store/store.h"
#include "tables/table_file.h"

namespace bushd::tables::store {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMachineHistory = "/var/lib/bushd/tables/history.sqlite";
constexpr const char* kHistoryBeside = ".history.sqlite";

bool knows(const Place& place, const std::string& name) {
  std::error_code error;
  if (fs::exists(place.directory / (name + ".toml"), error)) return true;
  if (!fs::exists(place.history, error)) return false;
  const auto history = History::open(place.history);
  return history && history->last(name).value_or(0) > 0;
}

}  // namespace

Place place_of(const fs::path& directory) {
  std::error_code error;
  const bool machine =
      directory == kMachineTables || fs::equivalent(directory, kMachineTables, error);
  return {.directory = directory,
          .history = machine ? fs::path(kMachineHistory) : directory / kHistoryBeside};
}

Result<TablePtr> open(std::string_view table, std::span<const Place> places) {
  const std::size_t at = table.rfind('@');
  const std::string name(table.substr(0, at));
  std::vector<fs::path> directories;
  for (const Place& place : places) directories.push_back(place.directory);
  const auto path = find(name, directories);
  if (at == std::string_view::npos) {
    if (!path) return fail(path.error());
    return load(*path);
  }
  if (!is_table_name(name)) return fail(path.error());
  for (const Place& place : places) {
    if (!knows(place, name)) continue;
    const Store store(place.directory, place.history);
    auto stored = store.read(name, table.substr(at + 1));
    if (!stored) return fail(stored.error());
    return make(std::move(stored->content), store.path_of(name).string());
  }
  return fail(path.error());
}

}  // namespace bushd::tables::store
