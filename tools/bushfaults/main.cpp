// bushfaults: days of trouble in minutes (docs/faults.md). The only file that includes CLI11 (slow
// to compile).
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <random>
#include <string>

#include "installation.h"
#include "summary.h"
#include "world.h"

namespace {

constexpr int kDone = 0;
constexpr int kViolation = 1;
constexpr int kUsage = 2;

int run(int argc, char** argv) {
  CLI::App app{
      "bushfaults: the daemon's core, the firmware core and motors in one process and on virtual\n"
      "time, under faults at random; everything is repeatable from the seed"};
  app.footer(
      "Exit codes: 0 no violation, 1 a violation (seed, virtual time and what led to it on "
      "stderr),\n"
      "2 wrong usage. Rates are events per simulated hour, 0 for none.");
  bushfaults::Options options;
  bool json = false;
  std::string seed = "fresh";
  std::string format = "fine";
  app.add_option("--seed", seed, "A number; `fresh`: another one each time, printed")
      ->capture_default_str();
  app.add_option("--hours", options.hours, "Simulated time")->capture_default_str();
  app.add_option("--motors", options.motors, "All of them")->capture_default_str();
  app.add_option("--mcus", options.mcus, "On one bus")->capture_default_str();
  app.add_option("--format", format, "Of displacements")
      ->check(CLI::IsMember({"fine", "coarse"}))
      ->capture_default_str();
  app.add_option("--crystal-ppm", options.crystal_ppm, "MCUs' clocks are off by up to this")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_flag("--json", json, "Summary as one JSON object");
  for (std::size_t i = 0; i < bushfaults::kFaultKinds; ++i) {
    const auto& kind = bushfaults::info(static_cast<bushfaults::FaultKind>(i));
    app.add_option("--" + std::string(kind.name), options.rates[i], std::string(kind.what))
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str()
        ->group("Faults per hour");
  }
  try {
    app.parse(argc, argv);
    options.seed = seed == "fresh" ? std::random_device{}() : std::stoull(seed);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  } catch (const std::logic_error&) {
    fmt::print(stderr, "bushfaults: --seed {}: not a number from 0 to 2^64 - 1\n", seed);
    return kUsage;
  }
  options.format = format == "fine" ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  auto config = bushfaults::make_installation(options.motors, options.mcus, options.format);
  if (!config) {
    fmt::print(stderr, "bushfaults: {}\n", config.error().text());
    return kUsage;
  }
  fmt::print(stderr, "seed {}\n", options.seed);

  const auto began = std::chrono::steady_clock::now();
  bushfaults::World world(options, std::move(*config));
  world.run();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  fmt::print("{}", json ? summary_json(world) : summary_text(world, took.count()));
  if (!world.witness().violation()) return kDone;
  std::fflush(stdout);
  fmt::print(stderr, "{}", story(world, options));
  return kViolation;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushfaults: {}\n", error.what());
    return kUsage;
  }
}
