#include "open_table.h"

#include <fmt/core.h>

#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "commands.h"
#include "tables/table_file.h"

namespace bushtab {

bushd::Result<bushd::tables::TablePtr> open_table(const std::string& table) {
  std::error_code error;
  if (table.find('/') != std::string::npos || std::string_view(table).ends_with(".toml") ||
      std::filesystem::is_regular_file(table, error)) {
    return bushd::tables::load(table);
  }
  const auto path = bushd::tables::find(table, bushd::tables::shipped_directories());
  if (!path) return bushd::fail(path.error());
  return bushd::tables::load(*path);
}

int refuse(const bushd::Error& error) {
  fmt::print(stderr, "{}\n", error.text());
  return kRefused;
}

}  // namespace bushtab
