// Subcommands that show state and health, once or again and again.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "base/printable.h"
#include "client/status_json.h"
#include "commands.h"
#include "health_view.h"
#include "live.h"
#include "named_motors.h"
#include "readiness.h"
#include "render.h"
#include "screen.h"
#include "watch.h"
#include "where.h"

namespace bushctl {
namespace {

using bushd::client::Client;
using bushd::client::Status;

constexpr std::uint32_t kMany = 1'000'000'000;

Command& add_timeout(Command& command, double* timeout_s) {
  return command.number("--timeout-s", timeout_s, 0.01, 3600.0,
                        "Longest wait for the state of the daemon");
}

struct StatusOptions {
  bushd::api::MotorNames motors;
  bool json = false;
  double timeout_s = 4;
  double wait_s = 0;
};

int show_status(Client& client, const StatusOptions& options) {
  auto status = client.status(milliseconds(options.timeout_s));
  if (!status) return failure(client, status.error());
  if (status->states.empty()) return complete(*status, status->missing_mcus, "MCUs");
  const auto chosen = only(std::move(*status), options.motors);
  if (!chosen) return failure(client, chosen.error());
  print_lines(options.json ? std::vector{json(*chosen)} : table(*chosen));
  return complete(*chosen, chosen->missing_mcus, "MCUs");
}

struct HealthOptions {
  double timeout_s = 4;
  bool json = false;
  bool watch = false;
  std::uint32_t count = 0;  // with `watch`; 0: until interrupted
};

void print(const Status& status, bool as_json) {
  print_lines(as_json ? std::vector{health_json(status)} : health_table(status));
  std::fflush(stdout);
}

int show_health(Client& client, const HealthOptions& options) {
  const auto health = client.status(milliseconds(options.timeout_s));
  if (!health) return failure(client, health.error());
  if (health->healths.empty()) return complete(*health, health->missing_buses, "buses");
  print(*health, options.json);
  return complete(*health, health->missing_buses, "buses");
}

int watch_health(const Connection& connection, const HealthOptions& options) {
  const bool in_terminal = !options.json && isatty(STDOUT_FILENO) != 0;
  std::optional<Screen> screen;
  std::vector<std::string> lines;
  unsigned shown = 0;
  const auto draw = [&](const std::string& last) {
    screen->show(cut(lines, Screen::size().rows, "'bushctl health' shows all", last));
  };
  return follow_live(connection, {.timeout = milliseconds(options.timeout_s),
                                  .for_ever = in_terminal,
                                  .next = &Client::next_health_or_input,
                                  .show =
                                      [&](const Status& health) {
                                        if (in_terminal) {
                                          if (!screen) screen.emplace();
                                          lines = health_table(health);
                                          draw("Ctrl-C ends");
                                        } else {
                                          print(health, options.json);
                                        }
                                        return options.count == 0 || ++shown < options.count;
                                      },
                                  .on_input = [] { return true; },
                                  .on_trouble =
                                      [&](const std::string& why) {
                                        if (screen)
                                          draw("what is shown is old: " + bushd::printable(why));
                                      },
                                  .close = [&] { screen.reset(); }});
}

void add_status(CommandLine& commands) {
  const auto options = std::make_shared<StatusOptions>();
  Command command = commands.add("status", "Show motors and MCUs");
  command.words("NAME", &options->motors, kMotorsOrAll, Command::Needed::kNo)
      .flag("--json", &options->json, "Print JSON")
      .number("--wait-s", &options->wait_s, 0.01, 3600.0,
              "First wait so long at most until the daemon answers and all MCUs take moves");
  add_timeout(command, &options->timeout_s).run([&commands, options] {
    if (options->wait_s > 0) {
      const int code = wait_until_ready(commands.connection(), milliseconds(options->wait_s));
      if (code != kDone) return code;
    }
    return with_client(commands.connection(),
                       [&](Client& client) { return show_status(client, *options); });
  });
}

void add_watch(CommandLine& commands) {
  struct Options {
    bushd::api::MotorNames motors;
    std::uint32_t count = 0;
    double timeout_s = 4;
  };
  const auto options = std::make_shared<Options>();
  Command command = commands.add("watch", "Show a live table; in a pipe: lines of what changes");
  command
      .footer(
          "Motors that move come first, then those at a limit or at an MCU that does not work, "
          "then "
          "those whose position is not sure, then the others; above them stand MCUs that do not "
          "work. A > at the end of a line: there is more than the terminal has room for. Keys: n "
          "and p, or Page Down and Page Up, turn pages, g is the first one; o is the order of the "
          "configuration; / takes a filter: part of the name of a motor, group or MCU, slit*, or "
          "@GROUP, up to Enter, and Esc drops it; q ends. When the daemon ends, watch waits until "
          "it is there again; in a pipe as long as --timeout-s.")
      .words("NAME", &options->motors, kMotorsOrAll, Command::Needed::kNo)
      .number<std::uint32_t>("--count", &options->count, 1, kMany, "Exit after so many snapshots");
  add_timeout(command, &options->timeout_s).run([&commands, options] {
    return watch(commands.connection(), {.names = options->motors,
                                         .timeout = milliseconds(options->timeout_s),
                                         .count = options->count});
  });
}

void add_health(CommandLine& commands) {
  const auto options = std::make_shared<HealthOptions>();
  Command command = commands.add("health", "Show bus and MCU diagnostics");
  command.flag("--json", &options->json, "Print JSON")
      .flag("--watch", &options->watch, "Print again every second")
      .number<std::uint32_t>("--count", &options->count, 1, kMany,
                             "With --watch: exit after so many");
  add_timeout(command, &options->timeout_s).run([&commands, options] {
    if (options->watch) return watch_health(commands.connection(), *options);
    return with_client(commands.connection(),
                       [&](Client& client) { return show_health(client, *options); });
  });
}

int show_where(Client& client, const std::vector<std::string>& names,
               std::chrono::milliseconds timeout, bool as_json) {
  const auto status = client.status(timeout);
  if (!status) return failure(client, status.error());
  const auto motors = where(*status, names, unix_us());
  if (!motors) return failure(client, motors.error());
  print_lines(as_json ? std::vector{json(*motors)} : table(*motors));
  return kDone;
}

void add_where(CommandLine& commands) {
  struct Options {
    bushd::api::MotorNames motors;
    bool json = false;
    double timeout_s = 4;
  };
  const auto options = std::make_shared<Options>();
  Command command = commands.add("where", "Show where motors stand: user, dial and steps");
  command.words("NAME", &options->motors, kMotorsOrAll, Command::Needed::kNo)
      .flag("--json", &options->json, "As JSON");
  add_timeout(command, &options->timeout_s).run_with_client([options](Client& client) {
    return show_where(client, options->motors, milliseconds(options->timeout_s), options->json);
  });
}

}  // namespace

void add_view_commands(CommandLine& commands) {
  add_status(commands);
  add_where(commands);
  add_watch(commands);
  add_health(commands);
}

}  // namespace bushctl
