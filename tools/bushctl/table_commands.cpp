// Subcommands about tables: which there are, which each group has, and what one says.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "commands.h"
#include "grid.h"
#include "render.h"
#include "tables/table.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using nlohmann::ordered_json;

std::map<std::string, api::TableRef> by_group(const bushd::client::Status& status) {
  std::map<std::string, api::TableRef> groups;
  for (const bushd::lcm::DescriptionMessage& mcu : status.descriptions) {
    if (!mcu.snapshot.is_mcu()) continue;
    for (const api::MotorDescription& motor : mcu.snapshot.motors) {
      groups.emplace(motor.group, motor.table);
    }
  }
  return groups;
}

std::string revision_text(std::uint32_t revision) {
  return revision > 0 ? fmt::to_string(revision) : "-";
}

void print_json(const std::map<std::string, api::TableRef>& groups,
                const std::vector<api::TableEntry>& entries) {
  ordered_json json = {{"groups", ordered_json::array()}, {"tables", ordered_json::array()}};
  for (const auto& [group, table] : groups) {
    json["groups"].push_back({{"group", group}, {"table", bushd::json_of(table)}});
  }
  for (const api::TableEntry& entry : entries) json["tables"].push_back(bushd::json_of(entry));
  fmt::print("{}\n", bushd::json_text(json));
}

void print(const std::map<std::string, api::TableRef>& groups,
           const std::vector<api::TableEntry>& entries) {
  using enum Align;
  Grid in_service({kLeft, kLeft, kRight, kLeft});
  in_service.row({"GROUP", "TABLE", "REVISION", "HASH"});
  for (const auto& [group, table] : groups) {
    in_service.row({bushd::printable(group), bushd::printable(table.name),
                    revision_text(table.revision), bushd::printable(table.hash)});
  }
  Grid tables({kLeft, kRight, kLeft, kRight, kRight, kRight});
  tables.row({"TABLE", "REVISION", "HASH", "CODES", "START", "MAX STEPS/S"});
  for (const api::TableEntry& entry : entries) {
    if (!entry.fault.empty()) continue;
    tables.row({bushd::printable(entry.name), revision_text(entry.table.revision),
                bushd::printable(entry.table.hash), fmt::to_string(entry.codes),
                fmt::format("{:.6g}", entry.start_steps_per_s),
                fmt::format("{:.6g}", entry.max_steps_per_s)});
  }
  print_lines(in_service.lines());
  fmt::print("\n");
  print_lines(tables.lines());
  for (const api::TableEntry& entry : entries) {
    if (!entry.fault.empty())
      fmt::print("{}: {}\n", bushd::printable(entry.name), bushd::printable(entry.fault));
  }
}

int list_tables(Client& client, bool as_json) {
  constexpr std::chrono::milliseconds kWithin{4000};
  const auto list = ask<api::TableList>(client, api::ListTables{});
  if (!list) return list.error();
  const auto status = client.status(kWithin);
  if (!status) return failure(client, status.error());
  if (status->missing_mcus.count > 0) return complete(*status, status->missing_mcus, "MCUs");
  (as_json ? print_json : print)(by_group(*status), list->entries);
  return kDone;
}

void print(const bushd::tables::TableContent& table) {
  fmt::print("{}\n", bushd::printable(table.name));
  if (!table.description.empty()) fmt::print("  {}\n", bushd::printable(table.description));
  fmt::print("  revision {}, SHA-256 {}\n", revision_text(table.revision),
             bushd::tables::content_hash(table));
  fmt::print("  time unit {} ns, cruise {}\n", table.time_unit_ns,
             table.cruise ? fmt::to_string(*table.cruise) : "as the last of accel");
  fmt::print("  accel {}\n", fmt::join(table.accel, " "));
  if (table.decel) fmt::print("  decel {}\n", fmt::join(*table.decel, " "));
}

int show_table(Client& client, const std::string& wanted, bool as_json) {
  const auto file = ask<api::TableFile>(client, api::GetTable{wanted});
  if (!file) return file.error();
  const bushd::tables::TableContent& table = file->content;
  // Computed here, so that it is what is shown that is hashed.
  if (const auto fault = bushd::tables::check(table)) {
    fmt::print(stderr, "bushctl: the daemon's answer brings no table: {}: {}\n",
               bushd::printable(fault->key), bushd::printable(fault->message));
    return kFailed;
  }
  if (as_json) {
    fmt::print("{}\n", bushd::json_text(bushd::json_of(
                           api::TableFile{table, bushd::tables::content_hash(table)})));
  } else {
    print(table);
  }
  return kDone;
}

void add_list(CommandLine& commands) {
  const auto json = std::make_shared<bool>(false);
  commands.add("list", "List the tables, and the table of each group", "table")
      .flag("--json", json.get(), "Print JSON")
      .run_with_client([json](Client& client) { return list_tables(client, *json); });
}

void add_show(CommandLine& commands) {
  struct Options {
    std::string table;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  commands.add("show", "Show a table", "table")
      .option("TABLE", &options->table, "NAME, NAME@REVISION or NAME@TAG")
      .flag("--json", &options->json, "Print JSON")
      .run_with_client(
          [options](Client& client) { return show_table(client, options->table, options->json); });
}

void add_use(CommandLine& commands) {
  const auto request = std::make_shared<api::UseTable>();
  commands.add("use", "Give a group another table", "table")
      .footer(
          "TABLE is NAME, NAME@REVISION or NAME@TAG, as for bushtab. Motors that move keep their "
          "table; once those of the group's MCUs stand, the MCUs get the new one, and the next "
          "move is by it. It stays in service when the daemon is started again.")
      .option("GROUP", &request->group, "The group")
      .option("TABLE", &request->table, "Table of the group from the next move on")
      .run([&commands, request] { return send(commands.connection(), *request); });
}

void add_reload(CommandLine& commands) {
  commands
      .add("reload",
           "Reload the tables of all groups; an invalid one leaves the old one in service", "table")
      .run([&commands] { return send(commands.connection(), api::ReloadTables{}); });
}

}  // namespace

void add_table_commands(CommandLine& commands) {
  commands.add_group("table", "Show and change which table each group moves by");
  add_list(commands);
  add_show(commands);
  add_use(commands);
  add_reload(commands);
}

}  // namespace bushctl
