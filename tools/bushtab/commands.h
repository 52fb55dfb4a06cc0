// What bushtab does. Every command returns the exit code: 0 done, 1 refused (the reason is on
// stderr).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/message.h"

namespace bushtab {

inline constexpr int kDone = 0;
inline constexpr int kRefused = 1;

// `table` is a file's path (it contains '/', ends in ".toml" or names a file that is there) or the
// name of a shipped table.
int show(const std::string& table, bool json);
int check(const std::vector<std::string>& tables);

struct Expansion {
  std::string table;
  std::int64_t steps = 0;  // -INT32_MAX .. INT32_MAX
  std::uint32_t tick_us = 0;
  bushd_format format = BUSHD_FORMAT_FINE;
};
int expand(const Expansion& expansion);

}  // namespace bushtab
