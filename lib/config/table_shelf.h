// Tables by path, so that groups that name the same one share it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/config.h"
#include "tables/table_file.h"
#include "tables/toml_reader.h"

namespace bushd::config {

class TableShelf {
 public:
  explicit TableShelf(const std::filesystem::path& config_path)
      : directories_(table_directories(config_path)) {}

  Result<tables::TablePtr> get(const tables::TomlReader& reader, const std::string& group,
                               const std::string& name) {
    const auto path = tables::find(name, directories_);
    if (!path) return fail(reader.error("table", path.error().text()));
    if (const auto shelved = tables_.find(*path); shelved != tables_.end()) return shelved->second;
    auto table = tables::load(*path);
    if (!table) {
      const Error user = reader.error("table", "");
      table.error().message +=
          fmt::format(" (the table of group \"{}\", {}:{})", group, user.file, user.line);
      return table;
    }
    return tables_.emplace(*path, std::move(*table)).first->second;
  }

 private:
  std::vector<std::filesystem::path> directories_;
  std::map<std::filesystem::path, tables::TablePtr> tables_;
};

}  // namespace bushd::config
