#include "tables/store/open.h"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "tables/store/store.h"
#include "tables/table_file.h"
#include "tables/toml_file.h"

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

Result<Found> find(std::string_view table, std::span<const Place> places) {
  const std::size_t at = table.rfind('@');
  const std::string name(table.substr(0, at));
  std::vector<fs::path> directories;
  for (const Place& place : places) directories.push_back(place.directory);
  const auto path = tables::find(name, directories);
  if (at == std::string_view::npos) {
    if (!path) return fail(path.error());
    const auto text = read_text(*path);
    if (!text) return fail(text.error());
    auto content = parse_content(*text, path->string());
    if (!content) return fail(content.error());
    return Found{*path, std::move(*content)};
  }
  // Not just missing: what is there cannot be looked at.
  if (!is_table_name(name) || (!path && !path.error().file.empty())) return fail(path.error());
  for (const Place& place : places) {
    if (!knows(place, name)) continue;
    const Store store(place.directory, place.history);
    auto stored = store.read(name, table.substr(at + 1));
    if (!stored) return fail(stored.error());
    return Found{store.path_of(name), std::move(stored->content)};
  }
  return fail(path.error());
}

Result<TablePtr> open(std::string_view table, std::span<const Place> places) {
  auto found = find(table, places);
  if (!found) return fail(found.error());
  return make(std::move(found->content), found->path.string());
}

}  // namespace bushd::tables::store
