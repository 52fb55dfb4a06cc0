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

// "5.5" would otherwise be called out of range.
std::string refuse_fraction(const std::string& value) {
  const std::size_t first_digit = value.starts_with('-') || value.starts_with('+') ? 1 : 0;
  const bool whole = value.size() > first_digit &&
                     value.find_first_not_of("0123456789", first_digit) == std::string::npos;
  return whole ? std::string() : value + " is not a whole number";
}

int run(int argc, char** argv) {
  CLI::App app{"bushtab: shows, checks and expands acceleration tables"};
  app.footer("Exit codes: 0 done, 1 refused (reason on stderr), 2 wrong usage.");
  app.require_subcommand(1);

  std::string table;
  bool json = false;
  CLI::App* show = app.add_subcommand("show", "Speeds, times and sizes of a table");
  show->add_option("TABLE", table, "A table's file or the name of a shipped table")->required();
  show->add_flag("--json", json, "As JSON");

  std::vector<std::string> tables;
  CLI::App* check = app.add_subcommand("check", "Says of every table whether it is good");
  check->add_option("TABLE", tables, "Tables' files or names of shipped tables")->required();

  bushtab::Expansion expansion;
  std::string format;
  CLI::App* expand = app.add_subcommand(
      "expand", "A move as CSV tick,displacement: exactly what the daemon would send");
  expand->footer(
      "Displacements of format coarse are the bytes on the line: bit 7 is 1 if the motor goes\n"
      "forward, bits 6..0 count its steps in the tick: 130 is +2, 2 is -2. Those of format fine\n"
      "are signed, in 1/256 step: 512 is +2, -512 is -2.");
  constexpr std::int64_t kMaxSteps = std::numeric_limits<std::int32_t>::max();
  expand->add_option("--table", expansion.table, "A table's file or the name of a shipped table")
      ->required();
  expand->add_option("--steps", expansion.steps, "Length and direction of the move")
      ->required()
      ->check(refuse_fraction)
      ->check(CLI::Range(-kMaxSteps, kMaxSteps));
  expand->add_option("--tick-us", expansion.tick_us, "Length of a tick in us")
      ->required()
      ->check(refuse_fraction)
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
  if (check->parsed()) return bushtab::check(tables);
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
