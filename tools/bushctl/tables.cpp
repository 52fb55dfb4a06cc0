// Which tables there are, which each group has, and what one says.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "base/printable.h"
#include "commands.h"
#include "grid.h"
#include "render.h"

namespace bushctl {
namespace {

using bushd::table_entry_t;
using bushd::table_ref_t;
using bushd::table_request_t;
using bushd::table_t;
using nlohmann::ordered_json;

std::string dump(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::map<std::string, table_ref_t> by_group(const bushd::lcm::Snapshot& snapshot) {
  std::map<std::string, table_ref_t> groups;
  for (const bushd::state_t& mcu : snapshot.mcus) {
    for (const bushd::motor_state_t& motor : mcu.motors) groups.emplace(motor.group, motor.table);
  }
  return groups;
}

std::string revision_text(std::int32_t revision) {
  return revision > 0 ? fmt::to_string(revision) : "-";
}

void print_json(const std::map<std::string, table_ref_t>& groups,
                const std::vector<table_entry_t>& entries) {
  ordered_json json = {{"groups", ordered_json::array()}, {"tables", ordered_json::array()}};
  for (const auto& [group, table] : groups) {
    json["groups"].push_back({{"group", group},
                              {"table", table.name},
                              {"revision", table.revision},
                              {"hash", table.hash}});
  }
  for (const table_entry_t& entry : entries) {
    if (!entry.fault.empty()) {
      json["tables"].push_back({{"table", entry.name}, {"fault", entry.fault}});
      continue;
    }
    json["tables"].push_back({{"table", entry.name},
                              {"revision", entry.table.revision},
                              {"hash", entry.table.hash},
                              {"codes", entry.codes},
                              {"start_steps_per_s", entry.start_steps_per_s},
                              {"max_steps_per_s", entry.max_steps_per_s}});
  }
  fmt::print("{}\n", dump(json));
}

void print(const std::map<std::string, table_ref_t>& groups,
           const std::vector<table_entry_t>& entries) {
  using enum Align;
  Grid in_service({kLeft, kLeft, kRight, kLeft});
  in_service.row({"GROUP", "TABLE", "REVISION", "HASH"});
  for (const auto& [group, table] : groups) {
    in_service.row({bushd::printable(group), bushd::printable(table.name),
                    revision_text(table.revision), bushd::printable(table.hash)});
  }
  Grid tables({kLeft, kRight, kLeft, kRight, kRight, kRight});
  tables.row({"TABLE", "REVISION", "HASH", "CODES", "START", "MAX STEPS/S"});
  for (const table_entry_t& entry : entries) {
    if (!entry.fault.empty()) continue;
    tables.row({bushd::printable(entry.name), revision_text(entry.table.revision),
                bushd::printable(entry.table.hash), fmt::to_string(entry.codes),
                fmt::format("{:.6g}", entry.start_steps_per_s),
                fmt::format("{:.6g}", entry.max_steps_per_s)});
  }
  for (const std::string& line : in_service.lines()) fmt::print("{}\n", line);
  fmt::print("\n");
  for (const std::string& line : tables.lines()) fmt::print("{}\n", line);
  for (const table_entry_t& entry : entries) {
    if (!entry.fault.empty())
      fmt::print("{}: {}\n", bushd::printable(entry.name), bushd::printable(entry.fault));
  }
}

// Nothing when the daemon did not answer, or not with what was asked for; stderr says which.
std::optional<bushd::table_reply_t> ask(bushd::lcm::Client& client, std::int8_t kind,
                                        const std::string& table, int* code) {
  table_request_t request{};
  request.kind = kind;
  request.table = table;
  auto reply = client.ask(request);
  if (!reply) {
    *code = failure(client, reply.error());
    return std::nullopt;
  }
  if (reply->done != 0) return std::move(*reply);
  fmt::print(stderr, "bushctl: {}\n", bushd::printable(reply->reason));
  *code = kFailed;
  return std::nullopt;
}

}  // namespace

int list_tables(bushd::lcm::Client& client, bool as_json) {
  constexpr std::chrono::milliseconds kWithin{2000};
  int code = kDone;
  const auto reply = ask(client, table_request_t::LIST, "", &code);
  if (!reply) return code;
  const auto snapshot = client.snapshot(kWithin);
  if (!snapshot) return failure(client, snapshot.error());
  (as_json ? print_json : print)(by_group(*snapshot), reply->entries);
  return kDone;
}

int show_table(bushd::lcm::Client& client, const std::string& wanted, bool as_json) {
  int code = kDone;
  const auto reply = ask(client, table_request_t::GET, wanted, &code);
  if (!reply) return code;
  if (reply->tables.empty()) {
    fmt::print(stderr, "bushctl: the daemon's answer brings no table\n");
    return kFailed;
  }
  const table_t& table = reply->tables.front();
  if (as_json) {
    ordered_json json = {{"name", table.name},
                         {"description", table.description},
                         {"revision", table.revision},
                         {"sha256", table.hash},
                         {"time_unit_ns", table.time_unit_ns}};
    if (table.cruise != 0) json["cruise"] = table.cruise;
    json["accel"] = table.accel;
    if (!table.decel.empty()) json["decel"] = table.decel;
    fmt::print("{}\n", dump(json));
    return kDone;
  }
  fmt::print("{}\n", bushd::printable(table.name));
  if (!table.description.empty()) fmt::print("  {}\n", bushd::printable(table.description));
  fmt::print("  revision {}, SHA-256 {}\n", revision_text(table.revision),
             bushd::printable(table.hash));
  fmt::print("  time unit {} ns, cruise {}\n", table.time_unit_ns,
             table.cruise != 0 ? fmt::to_string(table.cruise) : "as the last of accel");
  fmt::print("  accel {}\n", fmt::join(table.accel, " "));
  if (!table.decel.empty()) fmt::print("  decel {}\n", fmt::join(table.decel, " "));
  return kDone;
}

}  // namespace bushctl
