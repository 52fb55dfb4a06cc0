// envelope: makes and changes the file of an envelope, and draws its run by its table.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/printable.h"
#include "commands.h"
#include "curve.h"
#include "json.h"
#include "motion/zone_run.h"
#include "open_table.h"
#include "tables/speed_zones.h"
#include "tables/store/atomic_file.h"
#include "tables/store/open.h"

namespace bushtab {
namespace {

using bushd::Result;
using bushd::motion::ZoneRun;
using bushd::tables::SpeedZones;
namespace tables = bushd::tables;
namespace fs = std::filesystem;

constexpr double kMsPerNs = 1e-6;

bool changes(const Envelope& wanted) {
  return wanted.table || wanted.by || wanted.steps_per_unit || !wanted.zones.empty() ||
         wanted.end || wanted.description;
}

// What the command line says, over what the file says.
SpeedZones changed(SpeedZones zones, const Envelope& wanted) {
  if (wanted.table) zones.table = *wanted.table;
  if (wanted.by) {
    zones.by = *wanted.by == "position" ? SpeedZones::By::kPosition : SpeedZones::By::kDistance;
  }
  if (wanted.steps_per_unit) zones.steps_per_unit = wanted.steps_per_unit;
  if (!wanted.zones.empty()) zones.zones = wanted.zones;
  if (wanted.end) zones.end = *wanted.end;
  if (wanted.description) zones.description = *wanted.description;
  return zones;
}

// Checked as a file is, so that the file that is written can be read.
Result<SpeedZones> envelope_of(const fs::path& path, const Envelope& wanted) {
  std::error_code error;
  const bool is_there = fs::exists(path, error);
  if (!changes(wanted)) return tables::load_zones(path);
  if (is_there && !wanted.replace) {
    return bushd::fail(
        bushd::Error{.message = "exists; with --replace it gets what is given, and keeps the rest",
                     .file = path.string()});
  }
  SpeedZones zones;
  if (is_there) {
    auto old = tables::load_zones(path);
    if (!old) return old;
    zones = std::move(*old);
  } else if (!wanted.table || wanted.zones.empty() || !wanted.end) {
    return bushd::fail(bushd::Error{.message = "is new; it needs --table, --zone and --end",
                                    .file = path.string()});
  }
  return tables::parse_zones(tables::to_text(changed(std::move(zones), wanted)), path.string());
}

std::vector<CurveStep> curve_of_run(const ZoneRun& run) {
  std::vector<CurveStep> curve;
  std::uint64_t time_ns = 0;
  std::uint64_t step = 0;
  const auto add = [&](std::uint32_t steps, std::uint64_t delay_ns) {
    step += steps;
    time_ns += steps * delay_ns;
    curve.push_back({.delay_ns = delay_ns, .time_ns = time_ns, .step = step});
  };
  // Between the first and the last of equal delays a line is straight.
  for (const bushd::motion::Delays& delays : run.delays) {
    const std::uint64_t delay_ns = std::uint64_t{delays.delay} * run.unit_ns;
    add(1, delay_ns);
    if (delays.steps > 1) add(delays.steps - 1, delay_ns);
  }
  return curve;
}

std::vector<double> fastest_steps_per_s(const ZoneRun& run) {
  std::vector<double> fastest(run.parts.size(), 0);
  std::size_t part = 0;
  std::uint32_t left = run.parts.front().steps;
  for (const bushd::motion::Delays& delays : run.delays) {
    if (left == 0) left = run.parts[++part].steps;
    left -= delays.steps;
    fastest[part] =
        std::max(fastest[part], 1e9 / (static_cast<double>(delays.delay) * run.unit_ns));
  }
  return fastest;
}

struct Drawn {
  std::string name;
  fs::path path;
  SpeedZones zones;
  ZoneRun run;
};

void show_json(const Drawn& drawn) {
  nlohmann::ordered_json zones = nlohmann::ordered_json::array();
  const auto fastest = fastest_steps_per_s(drawn.run);
  for (std::size_t i = 0; i < drawn.run.parts.size(); ++i) {
    zones.push_back({{"from", drawn.zones.zones[i].from},
                     {"speed", drawn.zones.zones[i].speed},
                     {"steps", drawn.run.parts[i].steps},
                     {"end_ns", drawn.run.parts[i].end_ns},
                     {"peak_steps_per_s", fastest[i]}});
  }
  print_json({{"name", drawn.name},
              {"path", drawn.path.string()},
              {"description", drawn.zones.description},
              {"table", drawn.zones.table},
              {"by", drawn.zones.by == SpeedZones::By::kDistance ? "distance" : "position"},
              {"steps_per_unit", drawn.zones.steps_per_unit.value_or(1)},
              {"end", drawn.zones.end},
              {"steps", drawn.run.steps()},
              {"time_ns", drawn.run.end_ns()},
              {"zones", zones}});
}

void show_text(const Drawn& drawn) {
  const bool steps = !drawn.zones.steps_per_unit;
  fmt::print("{} ({})\n\n", bushd::printable(drawn.name), bushd::printable(drawn.path.string()));
  if (!drawn.zones.description.empty()) {
    fmt::print("  {}\n\n", bushd::printable(drawn.zones.description));
  }
  fmt::print("  by {}, in {}, table {}, {} steps, {:.3f} ms\n\n",
             drawn.zones.by == SpeedZones::By::kDistance ? "distance" : "position",
             steps ? "steps" : fmt::format("units of {} steps", *drawn.zones.steps_per_unit),
             bushd::printable(drawn.zones.table), drawn.run.steps(),
             static_cast<double>(drawn.run.end_ns()) * kMsPerNs);
  fmt::print("{:>12} {:>12} {:>12} {:>12} {:>16}\n", "from", "speed", "steps", "until ms",
             "up to steps/s");
  const auto fastest = fastest_steps_per_s(drawn.run);
  for (std::size_t i = 0; i < drawn.run.parts.size(); ++i) {
    fmt::print("{:>12.10g} {:>12.10g} {:>12} {:>12.3f} {:>16.6g}\n", drawn.zones.zones[i].from,
               drawn.zones.zones[i].speed, drawn.run.parts[i].steps,
               static_cast<double>(drawn.run.parts[i].end_ns) * kMsPerNs, fastest[i]);
  }
  fmt::print("{:>12.10g}\n\n", drawn.zones.end);
}

}  // namespace

int envelope(const Places& places, const Envelope& wanted) {
  const std::string directory =
      places.directory.empty() ? tables::store::kMachineTables : places.directory;
  const fs::path path = tables::envelope_path(wanted.name, directory);
  auto zones = envelope_of(path, wanted);
  if (!zones) return refuse(zones.error());
  // Its table lies beside it, or is shipped.
  const Places beside{path.has_parent_path() ? path.parent_path().string() : ".", places.history};
  const auto table = open_table(beside, zones->table);
  if (!table) return refuse(table.error());
  auto run = bushd::motion::zone_run(*zones, (*table)->view());
  if (!run) {
    bushd::Error error = run.error();
    error.file = path.string();
    return refuse(error);
  }
  if (changes(wanted)) {
    if (const auto written = tables::store::replace_file(path, tables::to_text(*zones)); !written) {
      return refuse(written.error());
    }
    fmt::print(stderr, "{} is written\n", bushd::printable(path.string()));
  }
  const Drawn drawn{path.stem().string(), path, std::move(*zones), std::move(*run)};
  const std::vector<Curve> curves{{drawn.name, curve_of_run(drawn.run)}};
  if (!wanted.svg.empty() || !wanted.png.empty()) {
    const auto pictures = write_pictures("Envelope by the table " + drawn.zones.table + ":", curves,
                                         wanted.svg, wanted.png);
    return pictures ? kDone : refuse(pictures.error());
  }
  if (wanted.json) {
    show_json(drawn);
    return kDone;
  }
  show_text(drawn);
  draw_in_terminal("steps/s over the way", curves, Over::kSteps);
  return kDone;
}

}  // namespace bushtab
