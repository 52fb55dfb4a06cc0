// bushtab: shows, checks and expands acceleration tables. The only file that includes CLI11 (slow
// to compile).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "commands.h"

namespace {

constexpr int kUsage = 2;

int run(int argc, char** argv) {
  CLI::App app{"bushtab: shows, checks and expands acceleration tables"};
  app.footer("Exit codes: 0 done, 1 refused (reason on stderr), 2 wrong usage.");
  app.require_subcommand(1);

  std::string table;
  bool json = false;
  CLI::App* show = app.add_subcommand("show", "Speeds, times and sizes of a table");
  show->add_option("TABLE", table, "A table's file or the name of a shipped table")->required();
  show->add_flag("--json", json, "As JSON");

  std::vector<std::string> files;
  CLI::App* check = app.add_subcommand("check", "Checks table files");
  check->add_option("FILE", files, "Table files")->required();

  bushtab::Expansion expansion;
  std::string format;
  CLI::App* expand = app.add_subcommand(
      "expand", "A move as CSV tick,displacement: exactly what the daemon would send");
  constexpr std::int64_t kMaxSteps = std::numeric_limits<std::int32_t>::max();
  expand->add_option("--table", expansion.table, "A table's file or the name of a shipped table")
      ->required();
  expand->add_option("--steps", expansion.steps, "Length and direction of the move")
      ->required()
      ->check(CLI::Range(-kMaxSteps, kMaxSteps));
  expand->add_option("--tick-us", expansion.tick_us, "Length of a tick in us")
      ->required()
      ->check(CLI::Range(BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000));
  expand->add_option("--format", format, "coarse (a byte) or fine (steps x 256)")
      ->required()
      ->check(CLI::IsMember({"coarse", "fine"}));

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? bushtab::kDone : kUsage;
  }
  if (show->parsed()) return bushtab::show(table, json);
  if (check->parsed()) return bushtab::check(files);
  expansion.format = format == "coarse" ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE;
  return bushtab::expand(expansion);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bushtab: %s\n", error.what());
    return bushtab::kRefused;
  }
}
