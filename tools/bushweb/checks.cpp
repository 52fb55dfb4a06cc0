#include "checks.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tables/profiles/diagnostics.h"
#include "tables/table.h"

namespace bushweb {
namespace {

namespace tables = bushd::tables;
namespace profiles = tables::profiles;
using nlohmann::ordered_json;

constexpr std::size_t kMostCodes = 2 * 65535;

ordered_json index_of(const std::optional<std::size_t>& index) {
  return index ? ordered_json(*index) : ordered_json(nullptr);
}

Text told(std::int64_t id, const char* outcome, const std::string& reason, ordered_json list) {
  return result(id, outcome, reason, {{"diagnostics", std::move(list)}});
}

}  // namespace

Text checked(std::int64_t id, const api::TableFile& table) {
  const std::size_t codes =
      table.content.accel.size() + (table.content.decel ? table.content.decel->size() : 0);
  if (codes > kMostCodes) return refused(id, "a table has at most 65535 codes on each side");
  if (const auto fault = tables::check(table.content)) {
    return told(id, "fault", fault->message,
                {{{"severity", "error"},
                  {"rule", "format"},
                  {"side", fault->key},
                  {"index", index_of(fault->index)},
                  {"value", nullptr},
                  {"limit", nullptr},
                  {"message", fault->message}}});
  }
  const auto made = tables::make(table.content);
  if (!made) return refused(id, made.error().text());
  ordered_json list = ordered_json::array();
  for (const profiles::Diagnostic& found : profiles::diagnostics(**made, {})) {
    list.push_back(
        {{"severity", found.severity == profiles::Severity::kError ? "error" : "warning"},
         {"rule", found.rule},
         {"side", found.side},
         {"index", index_of(found.index)},
         {"value", found.value},
         {"limit", found.limit},
         {"message", found.message}});
  }
  return told(id, "done", fmt::format("checked: {} messages", list.size()), std::move(list));
}

}  // namespace bushweb
