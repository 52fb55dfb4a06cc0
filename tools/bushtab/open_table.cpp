#include "open_table.h"

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "commands.h"
#include "tables/table_file.h"

namespace bushtab {
namespace {

using bushd::Result;
namespace tables = bushd::tables;
namespace fs = std::filesystem;

constexpr const char* kDirectory = "/etc/bushd/tables";
constexpr const char* kHistory = "/var/lib/bushd/tables/history.sqlite";
constexpr const char* kHistoryBeside = ".history.sqlite";

fs::path directory_of(const Places& places) {
  return places.directory.empty() ? kDirectory : places.directory;
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
  fs::path history = places.history;
  if (history.empty()) {
    std::error_code error;
    history = fs::equivalent(directory, kDirectory, error) || directory == kDirectory
                  ? fs::path(kHistory)
                  : directory / kHistoryBeside;
  }
  return Home{tables::store::Store(directory, history), name};
}

Result<tables::TablePtr> open_table(const Places& places, const std::string& table) {
  const std::size_t at = table.rfind('@');
  std::error_code error;
  if (at != std::string::npos && !fs::exists(table, error)) {
    const auto home = home_of(places, table.substr(0, at));
    if (!home) return bushd::fail(home.error());
    auto stored = home->store.read(home->name, table.substr(at + 1));
    if (!stored) return bushd::fail(stored.error());
    return tables::make(std::move(stored->content), table);
  }
  if (is_path(table)) return tables::load(table);
  const auto path = tables::find(table, directories(places));
  if (!path) return bushd::fail(path.error());
  return tables::load(*path);
}

int refuse(const bushd::Error& error) {
  fmt::print(stderr, "{}\n", error.text());
  return kRefused;
}

}  // namespace bushtab
