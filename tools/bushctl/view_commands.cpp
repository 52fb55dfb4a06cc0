// Subcommands that show state and health, once or again and again.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "commands.h"
#include "health_view.h"
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

int show_status(Client& client, std::chrono::milliseconds timeout, bool as_json) {
  const auto status = client.status(timeout);
  if (!status) return failure(client, status.error());
  if (status->states.empty()) return complete(*status, status->missing_mcus, "MCUs");
  if (as_json) {
    fmt::print("{}\n", json(*status));
  } else {
    for (const std::string& line : table(*status)) fmt::print("{}\n", line);
  }
  return complete(*status, status->missing_mcus, "MCUs");
}

struct HealthOptions {
  double timeout_s = 4;
  bool json = false;
  bool watch = false;
  std::uint32_t count = 0;  // with `watch`; 0: until interrupted
};

void print(const Status& status, bool as_json) {
  if (as_json) {
    fmt::print("{}\n", health_json(status));
  } else {
    for (const std::string& line : health_table(status)) fmt::print("{}\n", line);
  }
  std::fflush(stdout);
}

int show_health(Client& client, const HealthOptions& options) {
  auto health = client.status(milliseconds(options.timeout_s));
  if (!health) return failure(client, health.error());
  if (health->healths.empty()) return complete(*health, health->missing_buses, "buses");
  if (!options.watch) {
    print(*health, options.json);
    return complete(*health, health->missing_buses, "buses");
  }
  std::optional<Screen> screen;
  if (!options.json && isatty(STDOUT_FILENO) != 0) screen.emplace("'bushctl health' shows all");
  for (unsigned shown = 0;;) {
    if (health && screen) screen->show(health_table(*health));
    if (health && !screen) print(*health, options.json);
    if (health && options.count > 0 && ++shown >= options.count) return kDone;
    if (!health && client.interrupted()) return kDone;
    if (!health && (client.ended() || !screen)) {
      screen.reset();
      return failure(client, health.error());
    }
    if (!health) screen->notice("no health from bushd; what is shown is old");
    health = client.next_health(milliseconds(options.timeout_s));
  }
}

void add_status(CommandLine& line) {
  struct Options {
    bool json = false;
    double timeout_s = 4;
    double wait_s = 0;
  };
  const auto options = std::make_shared<Options>();
  Command command = line.add("status", "Show all motors and MCUs");
  command.flag("--json", &options->json, "Print JSON")
      .number("--wait-s", &options->wait_s, 0.01, 3600.0,
              "First wait so long at most until the daemon answers and all MCUs take moves");
  add_timeout(command, &options->timeout_s).run([&line, options] {
    if (options->wait_s > 0) {
      const int code = wait_until_ready(line.connection(), milliseconds(options->wait_s));
      if (code != kDone) return code;
    }
    return with_client(line.connection(), [&](Client& client) {
      return show_status(client, milliseconds(options->timeout_s), options->json);
    });
  });
}

void add_watch(CommandLine& line) {
  struct Options {
    std::uint32_t count = 0;
    double timeout_s = 4;
  };
  const auto options = std::make_shared<Options>();
  Command command = line.add("watch", "Show a live table; in a pipe: lines of what changes");
  command.number<std::uint32_t>("--count", &options->count, 1, kMany,
                                "Exit after so many snapshots");
  add_timeout(command, &options->timeout_s).run([&line, options] {
    return with_client(line.connection(), [&](Client& client) {
      return watch(client, {.timeout = milliseconds(options->timeout_s), .count = options->count});
    });
  });
}

void add_health(CommandLine& line) {
  const auto options = std::make_shared<HealthOptions>();
  Command command = line.add("health", "Show bus and MCU diagnostics");
  command.flag("--json", &options->json, "Print JSON")
      .flag("--watch", &options->watch, "Print again every second")
      .number<std::uint32_t>("--count", &options->count, 1, kMany,
                             "With --watch: exit after so many");
  add_timeout(command, &options->timeout_s).run([&line, options] {
    return with_client(line.connection(),
                       [&](Client& client) { return show_health(client, *options); });
  });
}

int show_where(Client& client, const std::vector<std::string>& names,
               std::chrono::milliseconds timeout, bool as_json) {
  const auto status = client.status(timeout);
  if (!status) return failure(client, status.error());
  const auto motors = where(*status, names, unix_us());
  if (!motors) return failure(client, motors.error());
  if (as_json) {
    fmt::print("{}\n", json(*motors));
  } else {
    for (const std::string& text : table(*motors)) fmt::print("{}\n", text);
  }
  return kDone;
}

void add_where(CommandLine& line) {
  struct Options {
    bushd::api::MotorNames motors;
    bool json = false;
    double timeout_s = 4;
  };
  const auto options = std::make_shared<Options>();
  Command command = line.add("where", "Show where motors stand: user, dial and steps");
  command.words("NAME", &options->motors, "Motors; none: all", Command::Needed::kNo)
      .flag("--json", &options->json, "As JSON");
  add_timeout(command, &options->timeout_s).run([&line, options] {
    return with_client(line.connection(), [&](Client& client) {
      return show_where(client, options->motors, milliseconds(options->timeout_s), options->json);
    });
  });
}

}  // namespace

void add_view_commands(CommandLine& line) {
  add_status(line);
  add_where(line);
  add_watch(line);
  add_health(line);
}

}  // namespace bushctl
