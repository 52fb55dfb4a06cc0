// A table as clients get it, and set it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/fields.h"
#include "words/table_content.h"

namespace bushd::api {

struct TableFile {
  words::TableContent content{};
  // SHA-256 of what moves a motor, 64 hexadecimal digits; from the daemon only. "": it is no table.
  std::string hash{};
  // What no file can say becomes 0, which tables::check() names.
  static void fields(auto& self, auto& visit) {
    constexpr fields::OrZero<std::int32_t> kCode{65535};
    auto& content = self.content;
    std::uint16_t cruise_code = content.cruise.value_or(0);
    std::int32_t cruise_told = cruise_code;
    std::vector<std::uint16_t> decel_codes = content.decel.value_or(std::vector<std::uint16_t>{});
    visit("name", content.name);
    visit("description", content.description);
    visit("revision", content.revision, fields::OrZero<std::int32_t>{INT32_MAX});
    visit("hash", self.hash);
    visit("time_unit_ns", content.time_unit_ns,
          fields::OrZero<std::int64_t>{words::TableContent::kMaxTimeUnitNs});
    visit("cruise", cruise_told, fields::If{cruise_told != 0});
    visit.list("accel_count", "accel", content.accel, kCode);
    visit.list("decel_count", "decel", decel_codes, kCode);
    kCode.taken(cruise_told, cruise_code);
    visit.set(content.cruise, cruise_told == 0 ? std::optional<std::uint16_t>{} : cruise_code);
    visit.set(content.decel, decel_codes.empty() ? std::optional<std::vector<std::uint16_t>>{}
                                                 : std::optional(std::move(decel_codes)));
  }
  friend bool operator==(const TableFile&, const TableFile&) = default;
};

}  // namespace bushd::api
