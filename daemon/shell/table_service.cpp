#include "daemon/shell/table_service.h"

#include <utility>

#include "daemon/model/table_ref.h"

namespace bushd::daemon {
namespace {

api::TableEntry entry_of(const std::string& name, const Result<tables::TablePtr>& table) {
  api::TableEntry entry{.name = name};
  if (!table) {
    entry.fault = table.error().text();
    return entry;
  }
  const bushd_table& view = (*table)->view();
  const double unit_s = view.time_unit_ns * 1e-9;
  entry.table = ref_to(**table);
  entry.codes =
      static_cast<std::int32_t>(view.accel.count + ((*table)->symmetric() ? 0 : view.decel.count));
  entry.start_steps_per_s = 1 / (view.accel.code[0] * unit_s);
  entry.max_steps_per_s = 1 / (bushd_table_fastest(&view) * unit_s);
  return entry;
}

api::Reply list(const TableLibrary& library) {
  api::TableList list;
  for (const std::string& name : library.names()) {
    list.entries.push_back(entry_of(name, library.open(name)));
  }
  return api::Completed{.reason = "all tables", .detail = std::move(list)};
}

api::Reply get(const TableLibrary& library, const api::GetTable& request) {
  auto content = library.content(request.table);
  if (!content) return api::Refused{content.error().text()};
  std::string hash = tables::check(*content) ? "" : tables::content_hash(*content);
  return api::Completed{
      .reason = request.table,
      .detail = api::TableFile{.content = std::move(*content), .hash = std::move(hash)}};
}

api::Reply set(const TableLibrary& library, const api::SetTable& request, const std::string& by) {
  const auto revision =
      library.set(request.table, request.content.content, request.expected_hash, "set by " + by);
  if (!revision) return api::Refused{revision.error().text()};
  return api::Completed{
      .reason = request.table + ": revision " + std::to_string(*revision),
      .detail = api::TableList{{entry_of(request.table, library.open(request.table))}}};
}

}  // namespace

api::Reply answer(const TableLibrary& library, const api::Request& request, const std::string& by) {
  if (const auto* wanted = std::get_if<api::GetTable>(&request)) return get(library, *wanted);
  if (const auto* content = std::get_if<api::SetTable>(&request)) {
    return set(library, *content, by);
  }
  return list(library);
}

}  // namespace bushd::daemon
