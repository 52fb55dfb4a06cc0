// Table files as text: made anew, or changed with every comment kept.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables {

// A string of TOML in its quotes.
std::string quoted_toml(const std::string& text);

// A new file. Comments come first, a line each, wrapped to 100 columns.
// Precondition: check(content) finds nothing.
std::string to_text(const TableContent& content, const std::vector<std::string>& comments = {});

// `text` with its content replaced by `content`; what is the same in both stays as it is written,
// and comments among codes that go away move in front of those that come. `path` is only what
// errors say. Errors: `text` is not a table.
// Precondition: check(content) finds nothing.
Result<std::string> rewrite(std::string_view text, const TableContent& content,
                            const std::string& path);

}  // namespace bushd::tables
