// Subcommands that move motors along paths.
#include <fmt/format.h>

#include <memory>

#include "base/printable.h"
#include "commands.h"
#include "path_file.h"
#include "render.h"
#include "tables/toml_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;

struct PathOptions {
  std::string file;
  std::string corners = "continuous";
  std::string speed;
  std::string feed;
  bool wait = false;
  bool dry_run = false;
  bool json = false;
};

bushd::Result<PathFile> read_path(const PathOptions& options) {
  const auto text = bushd::tables::read_text(options.file, bushd::tables::kNumbersLimit);
  if (!text) return bushd::fail(text.error());
  return parse_path(*text, options.file, options.corners, options.speed, options.feed);
}

int check(const Connection& connection, const PathOptions& options) {
  auto path = read_path(options);
  if (!path) return wrong_usage(path.error());
  return show_plan(connection, path->parts, options.json,
                   [&](const std::string& why) { return path->located(why); });
}

int run(const Connection& connection, const PathOptions& options) {
  if (options.dry_run) return check(connection, options);
  auto path = read_path(options);
  if (!path) return wrong_usage(path.error());
  return send_parts(connection, path->parts,
                    options.wait ? Client::Until::kResult : Client::Until::kAnswered,
                    [&](const std::string& why) { return path->located(why); });
}

Command& describe(Command& command, const std::shared_ptr<PathOptions>& options) {
  return command
      .footer(
          "The first line of FILE names motors of one bus, each further one has a position of "
          "each, in its unit:\n"
          "  x, y\n"
          "  0, 0\n"
          "  10, 0.5\n"
          "The motors move from where they stand to the first of these points and on from point to "
          "point, along straight lines and by one run. Stops, pauses and limits of one of them "
          "ramp all down along the path. No last approach for backlash is made.")
      .option("FILE", &options->file, "Points, CSV")
      .choice(
          "--corners", &options->corners, {"continuous", "exact"},
          "Pass the points at speeds at which no motor jumps by more than it starts with, or rest "
          "at each")
      .option("--speed", &options->speed, "Not faster than this, in each motor's unit per second")
      .option("--feed", &options->feed,
              "Not faster along the way than this, per second, in the unit that the motors share");
}

}  // namespace

void add_path_commands(CommandLine& commands) {
  commands.add_group("path", "Move motors along a path of points");
  const auto checked = std::make_shared<PathOptions>();
  Command check_command = commands.add(
      "check",
      "Say how long a path takes, with --json also when each point is reached; moves nothing",
      "path");
  describe(check_command, checked)
      .flag("--json", &checked->json, "Print JSON")
      .run([&commands, checked] { return check(commands.connection(), *checked); });
  const auto made = std::make_shared<PathOptions>();
  Command run_command = commands.add("run", "Move along a path", "path");
  describe(run_command, made)
      .flag("--wait", &made->wait, "Wait for the result")
      .flag("--dry-run", &made->dry_run, "As 'path check'")
      .flag_with("--dry-run", "--json", &made->json, "With --dry-run: print JSON")
      .run([&commands, made] { return run(commands.connection(), *made); });
}

}  // namespace bushctl
