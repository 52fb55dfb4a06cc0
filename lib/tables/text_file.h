// Files of people, as text: one way for all of them, and one way to say why one cannot be read.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bushd::tables {

struct TextLimit {
  std::size_t bytes = 0;
  std::string_view told{};  // behind "larger than N bytes": what that is to be compared with
  // Also out of a pipe, as a shell makes one for `<(...)`. Reading waits for its end.
  bool pipes_too = false;
};

// A regular file: no folder, no device, which may never end.
Result<std::string> read_text(const std::filesystem::path& path, const TextLimit& limit);

// Columns of numbers (csv/number_csv.h): 100000 rows of a dozen motors with all their digits.
inline constexpr TextLimit kNumbersLimit = {
    .bytes = 64 * 1024 * 1024,
    .told = "100000 rows of ten columns need a quarter of that",
    .pipes_too = true};

}  // namespace bushd::tables
