// A table as clients get it, and set it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/fields.h"
#include "words/table_content.h"

namespace bushd::api {

struct TableFile {
  words::TableContent content{};
  std::string hash{};

  static constexpr std::string_view kName = "table";
  static constexpr std::string_view kMeaning = "What a table's file says (docs/tables.md).";
  // What no file can say becomes 0, which tables::check() names.
  static void fields(auto& self, auto& visit) {
    constexpr fields::Range<std::int32_t> kCodes = words::TableContent::kCode;
    constexpr fields::OrZero<std::int32_t> kCode{kCodes.most};
    constexpr fields::Unit kTimeUnit{"time_unit_ns"};
    auto& content = self.content;
    std::uint16_t cruise_code = content.cruise.value_or(0);
    std::int32_t cruise_told = cruise_code;
    std::vector<std::uint16_t> decel_codes = content.decel.value_or(std::vector<std::uint16_t>{});
    visit("name", content.name);
    visit("description", content.description);
    visit({"revision", "counted by bushtab from 1; 0: the file tells none"}, content.revision,
          fields::OrZero<std::int32_t>{INT32_MAX});
    visit({"hash",
           "SHA-256 of what moves a motor, 64 hexadecimal digits; from the daemon only. \"\": it "
           "is no table"},
          self.hash);
    visit({"time_unit_ns", "of the delays below",
           fields::Range<std::int64_t>{1, words::TableContent::kMaxTimeUnitNs}},
          content.time_unit_ns, fields::OrZero<std::int64_t>{words::TableContent::kMaxTimeUnitNs});
    visit({"cruise", kTimeUnit, "0: the last of accel", fields::Range{0, kCodes.most}}, cruise_told,
          fields::If{cruise_told != 0});
    visit.list("accel_count", {"accel", kTimeUnit, "slow to fast", kCodes}, content.accel, kCode);
    visit.list({"decel_count", "0: accel reversed"}, {"decel", kTimeUnit, "fast to slow", kCodes},
               decel_codes, kCode);
    kCode.taken(cruise_told, cruise_code);
    visit.set(content.cruise, cruise_told == 0 ? std::optional<std::uint16_t>{} : cruise_code);
    visit.set(content.decel, decel_codes.empty() ? std::optional<std::vector<std::uint16_t>>{}
                                                 : std::optional(std::move(decel_codes)));
  }
  friend bool operator==(const TableFile&, const TableFile&) = default;
};

}  // namespace bushd::api
