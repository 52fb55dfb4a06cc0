#include "open_table.h"

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>

#include "base/printable.h"
#include "commands.h"
#include "tables/store/open.h"
#include "tables/table_file.h"

namespace bushtab {
namespace {

using bushd::Result;
namespace tables = bushd::tables;
namespace store = bushd::tables::store;
namespace fs = std::filesystem;

fs::path directory_of(const Places& places) {
  return places.directory.empty() ? store::kMachineTables : places.directory;
}

store::Place place_of(const Places& places, const fs::path& directory) {
  store::Place place = store::place_of(directory);
  if (!places.history.empty()) place.history = places.history;
  return place;
}

bool is_path(const std::string& table) {
  std::error_code error;
  return table.find('/') != std::string::npos || std::string_view(table).ends_with(".toml") ||
         fs::is_regular_file(table, error);
}

}  // namespace

std::vector<fs::path> directories(const Places& places) {
  std::vector<fs::path> all{directory_of(places)};
  for (fs::path& shipped : tables::shipped_directories()) all.push_back(std::move(shipped));
  return all;
}

std::vector<std::string> table_names(const Places& places) {
  std::set<std::string> names;
  for (const fs::path& directory : directories(places)) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(directory, error)) {
      const std::string name = entry.path().stem().string();
      if (entry.path().extension() == ".toml" && !name.starts_with('.')) names.insert(name);
    }
  }
  return {names.begin(), names.end()};
}

Result<Home> home_of(const Places& places, const std::string& table) {
  fs::path directory = directory_of(places);
  std::string name = table;
  if (is_path(table)) {
    const fs::path path(table);
    if (path.extension() != ".toml") {
      return bushd::fail(
          bushd::Error{.message = "is not named NAME.toml, as tables are", .file = table});
    }
    directory = path.has_parent_path() ? path.parent_path() : ".";
    name = path.stem().string();
  }
  if (name.empty() || name.front() == '.' || name.size() > tables::kMaxNameLength) {
    return bushd::fail(
        fmt::format("\"{}\" is not a table's name; allowed: 1..{} bytes that do not "
                    "begin with '.'",
                    name.substr(0, tables::kMaxNameLength), tables::kMaxNameLength));
  }
  const store::Place place = place_of(places, directory);
  return Home{store::Store(place.directory, place.history), name};
}

Result<store::Stored> read_home(const Home& home) {
  auto stored = home.store.read(home.name);
  std::error_code error;
  if (stored || fs::exists(home.store.path_of(home.name), error)) return stored;
  if (!tables::find(home.name, tables::shipped_directories())) return stored;
  return bushd::fail(fmt::format(
      "\"{0}\" is a shipped table, which stays as it is; copy it first: \"bushtab copy {0} "
      "NEW\"",
      home.name));
}

Result<std::uint32_t> create_in(Home& home, const std::string& text, const std::string& note) {
  const fs::path directory = home.store.path_of(home.name).parent_path();
  std::error_code error;
  if (!directory.empty() && !fs::exists(directory, error)) {
    if (fs::create_directories(directory, error); error) {
      return bushd::fail(bushd::Error{.message = "cannot be made: " + error.message(),
                                      .file = directory.string()});
    }
    fmt::print(stderr, "made the directory {}\n", bushd::printable(directory.string()));
  }
  return home.store.create(home.name, text, note);
}

Result<tables::TablePtr> open_table(const Places& places, const std::string& table) {
  const std::size_t at = table.rfind('@');
  std::error_code error;
  const bool revision = at != std::string::npos && !fs::exists(table, error);
  const std::string file = revision ? table.substr(0, at) : table;
  if (is_path(file)) {
    if (!revision) return tables::load(table);
    const auto home = home_of(places, file);
    if (!home) return bushd::fail(home.error());
    auto stored = home->store.read(home->name, table.substr(at + 1));
    if (!stored) return bushd::fail(stored.error());
    return tables::make(std::move(stored->content), table);
  }
  std::vector<store::Place> all;
  for (const fs::path& directory : directories(places)) all.push_back(place_of(places, directory));
  return store::open(table, all);
}

int refuse(const bushd::Error& error) {
  fmt::print(stderr, "{}\n", bushd::printable_lines(error.text()));
  return kRefused;
}

}  // namespace bushtab
