#include "installation.h"

#include <fmt/core.h>

#include <array>

#include "link/line_budget.h"
#include "tables/table_file.h"

namespace bushfaults {
namespace {

// Full steps at up to 2500 steps/s, and one with a start within the tick; the faster tables need
// shorter ticks than a line for 32 motors can carry.
constexpr std::array<const char*, 4> kTables = {"bushd2-constant", "bushd2-scurve",
                                                "bushd2-exponential", "bushd2-resonance"};
constexpr std::array<std::uint32_t, 4> kBauds = {500'000, 1'000'000, 2'000'000, 4'000'000};

}  // namespace

bushd::Result<bushd::config::Config> make_installation(std::size_t motors, std::size_t mcus,
                                                       bushd_format format) {
  if (mcus == 0 || mcus > 255) return bushd::fail("--mcus must be 1 to 255");
  if (motors < mcus || motors > mcus * BUSHD_MOTORS_PER_MCU) {
    return bushd::fail(fmt::format("--motors must be {} to {} for {} MCUs: each has 1 to {} motors",
                                   mcus, mcus * BUSHD_MOTORS_PER_MCU, mcus, BUSHD_MOTORS_PER_MCU));
  }
  bushd::config::Config config;
  config.path = "bushfaults";
  for (const char* name : kTables) {
    const auto path = bushd::tables::find(name, bushd::tables::shipped_directories());
    if (!path) return bushd::fail(path.error());
    const auto table = bushd::tables::load(*path);
    if (!table) return bushd::fail(table.error());
    config.groups.push_back({.name = name, .table = *table});
  }
  std::vector<std::uint8_t> motors_of_mcu(mcus, 0);
  for (std::size_t i = 0; i < mcus; ++i) {
    config.mcus.push_back({.bus = {0},
                           .address = {static_cast<std::uint8_t>(i + 1)},
                           .id = fmt::format("hall:{}", i + 1)});
  }
  for (std::size_t i = 0; i < motors; ++i) {
    const std::size_t mcu = i % mcus;
    config.motors.push_back({.name = fmt::format("m{:02}", i + 1),
                             .mcu = {mcu},
                             .output = {motors_of_mcu[mcu]++},
                             .group = {i / mcus % kTables.size()}});
  }
  for (const std::uint32_t baud : kBauds) {
    if (bushd::link::line_load(baud, kTickUs * 1000, format, motors_of_mcu) >
        bushd::link::kMaxLineLoad) {
      continue;
    }
    config.buses.push_back(
        {.name = "hall", .port = "simulated", .baud = baud, .tick_us = kTickUs, .format = format});
    return config;
  }
  return bushd::fail(fmt::format("no line can carry {} motors; use fewer", motors));
}

}  // namespace bushfaults
