// Table files (docs/tables.md). Every refusal names file, line, key, cause and what is allowed.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables {

Result<TablePtr> load(const std::filesystem::path& path);

// `path` is only what errors and Table::path() say.
Result<TableContent> parse_content(std::string_view text, const std::string& path);
Result<TablePtr> parse(std::string_view text, const std::string& path);

// Whether it may be the name of a file without ".toml": does not lead elsewhere, not too long.
bool is_table_name(std::string_view name);

// The path of the first NAME.toml in `directories`; the error lists where it was looked for.
// What is not a table's name is refused.
Result<std::filesystem::path> find(std::string_view name,
                                   std::span<const std::filesystem::path> directories);

// Where the tables that come with bushd lie: $BUSHD_TABLES_DIR if set, else the source tree of a
// development build, then those that are installed with the program.
std::vector<std::filesystem::path> shipped_directories();

}  // namespace bushd::tables
