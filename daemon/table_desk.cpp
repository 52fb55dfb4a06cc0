#include "daemon/table_desk.h"

#include <limits>
#include <utility>

#include "lcm/wire.h"

namespace bushd::daemon {
namespace {

// What a file cannot say becomes what it cannot say either: 0, which the check of a table names.
std::uint16_t code(std::int32_t value) {
  return value < 0 || value > std::numeric_limits<std::uint16_t>::max()
             ? std::uint16_t{0}
             : static_cast<std::uint16_t>(value);
}

std::vector<std::uint16_t> codes(const std::vector<std::int32_t>& values) {
  std::vector<std::uint16_t> out;
  out.reserve(values.size());
  for (const std::int32_t value : values) out.push_back(code(value));
  return out;
}

tables::TableContent content_of(const table_t& message) {
  tables::TableContent content;
  content.name = message.name;
  content.description = message.description;
  content.revision = message.revision > 0 ? static_cast<std::uint32_t>(message.revision) : 0;
  if (message.time_unit_ns > 0 && message.time_unit_ns <= tables::kMaxTimeUnitNs) {
    content.time_unit_ns = static_cast<std::uint32_t>(message.time_unit_ns);
  }
  content.accel = codes(message.accel);
  if (!message.decel.empty()) content.decel = codes(message.decel);
  if (message.cruise != 0) content.cruise = code(message.cruise);
  return content;
}

table_t message_of(const tables::TableContent& content) {
  table_t message{};
  message.name = content.name;
  message.description = content.description;
  message.revision = static_cast<std::int32_t>(content.revision);
  message.hash = tables::content_hash(content);
  message.time_unit_ns = content.time_unit_ns;
  message.cruise = content.cruise.value_or(0);
  message.accel.assign(content.accel.begin(), content.accel.end());
  if (content.decel) message.decel.assign(content.decel->begin(), content.decel->end());
  message.accel_count = static_cast<std::int32_t>(message.accel.size());
  message.decel_count = static_cast<std::int32_t>(message.decel.size());
  return message;
}

table_entry_t entry_of(const std::string& name, const Result<tables::TablePtr>& table) {
  table_entry_t entry{};
  entry.name = name;
  if (!table) {
    entry.fault = table.error().text();
    return entry;
  }
  const bushd_table& view = (*table)->view();
  const double unit_s = view.time_unit_ns * 1e-9;
  entry.table.name = (*table)->name();
  entry.table.revision = static_cast<std::int32_t>((*table)->revision());
  entry.table.hash = (*table)->short_hash();
  entry.codes =
      static_cast<std::int32_t>(view.accel.count + ((*table)->symmetric() ? 0 : view.decel.count));
  entry.start_steps_per_s = 1 / (view.accel.code[0] * unit_s);
  entry.max_steps_per_s = 1 / (bushd_table_fastest(&view) * unit_s);
  return entry;
}

table_reply_t reply_to(const table_request_t& request, std::string reason) {
  table_reply_t reply{};
  reply.client_id = request.client_id;
  reply.number = request.number;
  reply.done = 1;
  reply.reason = std::move(reason);
  return reply;
}

table_reply_t list(const TableLibrary& library, const table_request_t& request) {
  table_reply_t reply = reply_to(request, "all tables");
  std::size_t left_out = 0;
  for (const std::string& name : library.names()) {
    reply.entries.push_back(entry_of(name, library.open(name)));
    reply.entry_count = static_cast<std::int32_t>(reply.entries.size());
    if (left_out == 0 && lcm::encode(reply)) continue;
    reply.entries.pop_back();
    reply.entry_count = static_cast<std::int32_t>(reply.entries.size());
    ++left_out;
  }
  if (left_out > 0) reply.reason = std::to_string(left_out) + " more do not fit one message";
  return reply;
}

table_reply_t get(const TableLibrary& library, const table_request_t& request) {
  const auto content = library.content(request.table);
  if (!content) return refusal(request, content.error().text());
  table_reply_t reply = reply_to(request, request.table);
  reply.tables.push_back(message_of(*content));
  reply.table_count = 1;
  if (lcm::encode(reply)) return reply;
  return refusal(request, request.table + " has too many codes for one message; use bushtab");
}

table_reply_t set(const TableLibrary& library, const table_request_t& request) {
  const auto revision = library.set(request.table, content_of(request.content.front()),
                                    request.expected_hash, "set by " + request.client_id);
  if (!revision) return refusal(request, revision.error().text());
  table_reply_t reply =
      reply_to(request, request.table + ": revision " + std::to_string(*revision));
  reply.entries.push_back(entry_of(request.table, library.open(request.table)));
  reply.entry_count = 1;
  return reply;
}

}  // namespace

Result<tables::TablePtr> table_of(const table_request_t& request) {
  if (request.content.size() != 1) return fail("a SET request brings one table as content");
  return tables::make(content_of(request.content.front()));
}

table_reply_t refusal(const table_request_t& request, const std::string& reason) {
  table_reply_t reply = reply_to(request, reason);
  reply.done = 0;
  return reply;
}

table_reply_t answer(const TableLibrary& library, const table_request_t& request) {
  switch (request.kind) {
    case table_request_t::LIST:
      return list(library, request);
    case table_request_t::GET:
      return get(library, request);
    case table_request_t::SET:
      return set(library, request);
    default:
      return refusal(request, "there is no request kind " + std::to_string(request.kind));
  }
}

}  // namespace bushd::daemon
