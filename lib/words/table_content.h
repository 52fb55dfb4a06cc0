// What a table's file says, as values: files, clients and the daemon speak of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/fields.h"

namespace bushd::words {

// In the file's order. Whether it is a table, tables::check() tells.
struct TableContent {
  static constexpr std::size_t kMaxNameLength = 63;
  // One second: above it nothing can be told apart any more, and the engine's sums of two rests fit
  // 32 bits.
  static constexpr std::uint32_t kMaxTimeUnitNs = 1'000'000'000;
  static constexpr bushd::fields::Range<std::int32_t> kCode{1, UINT16_MAX};  // time units

  std::string name{};
  std::uint32_t time_unit_ns = 0;
  std::vector<std::uint16_t> accel{};                 // slow to fast
  std::optional<std::vector<std::uint16_t>> decel{};  // fast to slow; none: accel reversed
  std::optional<std::uint16_t> cruise{};              // none: the last of accel
  std::string description{};
  std::uint32_t revision = 0;  // counted by bushtab from 1; 0: none
  friend bool operator==(const TableContent&, const TableContent&) = default;
};

}  // namespace bushd::words
