#include "tables/gentler.h"

#include <fmt/format.h>

#include <vector>

#include "tables/edit.h"

namespace bushd::tables {
namespace {

TableContent content_of(const Table& table) {
  const bushd_table& view = table.view();
  const auto codes = [](const bushd_ramp& side) {
    return std::vector<std::uint16_t>(side.code, side.code + side.count);
  };
  TableContent content{.name = table.name(),
                       .time_unit_ns = view.time_unit_ns,
                       .accel = codes(view.accel),
                       .cruise = view.cruise,
                       .description = table.description(),
                       .revision = table.revision()};
  if (!table.symmetric()) {
    const auto decel = codes(view.decel);
    content.decel.emplace(decel.rbegin(), decel.rend());
  }
  return content;
}

}  // namespace

Result<TablePtr> Gentler::of(const TablePtr& table, double share) {
  if (share == 1) return table;
  const std::pair key(
      fmt::format("{} {} {}", table->revision(), table->name(), table->content_hash()), share);
  if (const auto made = made_.find(key); made != made_.end()) return made->second;
  const bushd_table& view = table->view();
  const double codes = (view.accel.count + (table->symmetric() ? 0.0 : view.decel.count)) / share;
  if (codes > kMostCodes) {
    return fail(fmt::format(
        "with {} of its acceleration the table \"{}\" has {:.0f} codes; allowed: {}. Use a greater "
        "share, or a table with fewer codes (\"bushtab resample --codes\")",
        share, table->name(), codes, kMostCodes));
  }
  auto content = scale_acceleration(content_of(*table), share);
  if (!content) return fail(content.error());
  auto made = make(std::move(*content));
  if (made) made_.emplace(key, *made);
  return made;
}

}  // namespace bushd::tables
