// TOML text from outside, made safe: whatever the bytes are, the result is a document or an Error.
#pragma once

#include <toml++/toml.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "tables/text_file.h"

namespace bushd::tables {

// Two sides of 65535 codes take 1 MB with all separators; a parsed code takes about 100 bytes of
// memory.
inline constexpr std::size_t kMaxFileBytes = 2 * 1024 * 1024;

// A regular file of at most kMaxFileBytes. `largest`: how the error compares that to what is
// needed.
Result<std::string> read_text(
    const std::filesystem::path& path,
    std::string_view largest = "the longest table allowed needs half of that");

// SHA-256 of a text, 64 hexadecimal digits.
std::string text_sha256(std::string_view text);

// `path` is only what errors say.
Result<toml::table> parse_toml(std::string_view text, const std::string& path);

}  // namespace bushd::tables
