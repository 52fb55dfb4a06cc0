// bushfaults: days of trouble in minutes (docs/faults.md). The only file that includes CLI11 (slow
// to compile).
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "base/parse_error.h"
#include "base/printable.h"
#include "base/standard_output.h"
#include "made_config.h"
#include "summary.h"
#include "world.h"

namespace {

constexpr int kDone = 0;
constexpr int kViolation = 1;
constexpr int kUsage = 2;

// An option that the seed decides unless it is given.
template <class Value>
void add_way(CLI::App& app, const std::string& name, std::optional<Value>& way,
             const std::map<std::string, Value>& words) {
  std::vector<std::string> allowed;
  for (const auto& [word, value] : words) allowed.push_back(word);
  app.add_option_function<std::string>(
         name, [&way, words](const std::string& word) { way = words.at(word); },
         "As in bushd.toml (default: by the seed)")
      ->check(CLI::IsMember(allowed));
}

template <class Kind, std::size_t kSize>
void add_rates(CLI::App& app, std::array<double, kSize>& rates, const std::string& group) {
  for (std::size_t i = 0; i < kSize; ++i) {
    const bushfaults::KindInfo& kind = bushfaults::info(static_cast<Kind>(i));
    app.add_option("--" + std::string(kind.name), rates[i], std::string(kind.what))
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str()
        ->group(group);
  }
}

void add_bare(CLI::App& app, bushfaults::BareOptions& bare) {
  const std::string group = "Controllers without firmware";
  const auto add = [&](const std::string& name, auto& value, const std::string& what) {
    app.add_option(name, value, what)
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str()
        ->group(group);
  };
  add("--serial-pulse", bare.serial_pulse, "Serial ports that make the pulses of a motor each");
  add("--boards", bare.boards, "Commutator boards, of three motors each");
  add("--keypads", bare.keypads, "Keypads, each of one of these motors");
  add("--controller-faults", bare.faults_per_hour, "Faults of all of them per hour");
  add("--controller-commands", bare.commands_per_hour, "Commands for their motors per hour");
}

int run(int argc, char** argv) {
  CLI::App app{
      "bushfaults: the daemon's core, the firmware core and motors in one process and on virtual\n"
      "time, under faults at random; everything is repeatable from the seed"};
  app.footer(
      "Exit codes: 0 no violation, 1 a violation (seed, virtual time and what led to it on "
      "stderr),\n"
      "2 wrong usage. Rates are events per simulated hour, 0 for none.");
  app.set_version_flag("--version", BUSHD_VERSION);
  bushfaults::Options options;
  bool json = false;
  bool all_kinds = false;
  std::string seed = "fresh";
  bushfaults::Ways& ways = options.ways;
  app.add_option("--seed", seed, "Seed, a number; `fresh`: another one each time, printed")
      ->capture_default_str();
  app.add_option("--hours", options.hours, "Simulated hours")->capture_default_str();
  app.add_option("--motors", options.motors, "Number of motors")->capture_default_str();
  app.add_option("--mcus", options.mcus, "Number of MCUs on the bus")->capture_default_str();
  app.add_option("--absent-mcus", options.absent_mcus, "MCUs of --mcus that are never heard")
      ->capture_default_str();
  app.add_option("--late-mcus", options.late_mcus,
                 "MCUs of --mcus that go online within 10 minutes")
      ->capture_default_str();
  app.add_flag("--strict-known", options.strict_known,
               "Require known positions to be right also while MCUs are offline");
  app.add_flag(
      "--keep-positions", options.keep_positions,
      "Keep positions on a disk of the simulation (as do power-cuts and disk-faults); then "
      "there is no second daemon");
  add_way<bool>(app, "--moves", ways.table_runs, {{"stream", false}, {"table", true}});
  add_way<bool>(app, "--frames", ways.table_ticks, {{"ticks", false}, {"auto", true}});
  add_way<bushd_format>(app, "--format", ways.format,
                        {{"coarse", BUSHD_FORMAT_COARSE}, {"fine", BUSHD_FORMAT_FINE}});
  add_way<bushd_stop_mode>(app, "--emergency", ways.emergency_stop,
                           {{"ramp", BUSHD_STOP_RAMP},
                            {"immediate", BUSHD_STOP_IMMEDIATE},
                            {"disable", BUSHD_STOP_DISABLE}});
  add_way<bool>(app, "--required", ways.state_required, {{"no", false}, {"yes", true}});
  app.add_option_function<std::string>(
         "--line", [&ways](const std::string& line) { ways.slow_line = line == "slow"; },
         fmt::format("slow: ticks of {} us, at the slowest rate that carries the motors "
                     "(default: usual; with --all-kinds by the seed)",
                     bushfaults::kSlowTickUs))
      ->check(CLI::IsMember({"usual", "slow"}));
  app.add_option("--crystal-ppm", options.crystal_ppm, "Largest error of the MCUs' clocks")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_flag("--all-kinds", all_kinds,
               "All kinds at once: those whose rate is 0 get one by the seed");
  app.add_flag("--json", json, "Print the summary as a JSON object");
  add_bare(app, options.bare);
  add_rates<bushfaults::FaultKind>(app, options.fault_rates, "Faults per hour");
  add_rates<bushfaults::CommandKind>(app, options.command_rates, "Commands per hour");
  try {
    app.parse(argc, argv);
    options.seed = seed == "fresh" ? std::random_device{}() : std::stoull(seed);
  } catch (const CLI::ParseError& error) {
    return bushd::answered(app, error) ? kDone : kUsage;
  } catch (const std::logic_error&) {
    fmt::print(stderr, "bushfaults: --seed {}: not a number from 0 to 2^64 - 1\n",
               bushd::printable(seed));
    return kUsage;
  }
  if (all_kinds) {
    bushfaults::add_all_kinds(options.fault_rates, options.command_rates, options.seed);
  }
  if (rate(options.command_rates, bushfaults::CommandKind::kMcuProgram) > 0 &&
      (rate(options.command_rates, bushfaults::CommandKind::kCamac) > 0 ||
       rate(options.command_rates, bushfaults::CommandKind::kShutter) > 0)) {
    fmt::print(stderr,
               "bushfaults: --mcu-programs: MCUs with motors of CAMAC modules have none; leave out "
               "--camac-blocks and --shutter-blocks\n");
    return kUsage;
  }
  if (all_kinds) bushfaults::add_all_ways(ways, options.seed);
  options.all_kinds = all_kinds;
  auto config =
      bushfaults::make_installation(options.motors, options.mcus, options.ways, options.seed);
  if (!config) {
    fmt::print(stderr, "bushfaults: {}\n", config.error().text());
    return kUsage;
  }
  if (options.absent_mcus + options.late_mcus >= options.mcus) {
    fmt::print(stderr, "bushfaults: of --mcus one must be there from the beginning\n");
    return kUsage;
  }
  options.keep_positions |= rate(options.fault_rates, bushfaults::FaultKind::kPowerCut) > 0 ||
                            rate(options.fault_rates, bushfaults::FaultKind::kDiskFault) > 0;
  // Where one has moved motors, the store of the other is void (docs/positions.md).
  if (options.keep_positions) {
    options.fault_rates[static_cast<std::size_t>(bushfaults::FaultKind::kSecondDaemon)] = 0;
  }
  bushfaults::furnish(*config, options.fault_rates, options.command_rates, options.seed);
  auto whole = bushfaults::with_bare(*config, options.bare, options.seed);
  if (!whole) {
    fmt::print(stderr, "bushfaults: {}\n", whole.error().text());
    return kUsage;
  }
  fmt::print(stderr, "seed {}\n", options.seed);

  const std::clock_t began = std::clock();
  bushfaults::World world(options, std::move(*config), std::move(*whole));
  world.run();
  const double processor_s = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  fmt::print("{}", json ? summary_json(world) : summary_text(world, processor_s));
  if (!world.witness().violation()) return kDone;
  std::fflush(stdout);
  fmt::print(stderr, "{}", story(world, options));
  return kViolation;
}

}  // namespace

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    return bushd::finished_output(run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushfaults: {}\n", error.what());
    return kUsage;
  }
}
