#include "tables/speed_zones.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tables/table_text.h"
#include "tables/text_file.h"
#include "tables/toml_file.h"
#include "tables/toml_keys.h"

namespace bushd::tables {
namespace {

constexpr std::string_view kExtension = ".envelope";
constexpr TextLimit kEnvelopeLimit = {.bytes = 64 * 1024, .told = "100 zones need a tenth of that"};
constexpr const char* kZonesAllowed =
    "1 to 100 pairs, each [from, speed], as in [[0, 1000], [2500, 500]]";
// Codes are rounded up, so a table that was made for 4000 steps/s may reach a little less.
constexpr double kSameSpeed = 1.01;

Result<SpeedZones::Zone> read_zone(const TomlReader& toml, std::size_t index,
                                   const toml::node& node) {
  constexpr const char* kKey = "zones";
  const toml::array* const pair = node.as_array();
  if (pair == nullptr || pair->size() != 2) {
    return fail(toml.error(
        kKey, index,
        fmt::format("is {}; allowed: a pair [from, speed]",
                    pair == nullptr ? describe(node) : fmt::format("{} numbers", pair->size()))));
  }
  const auto from = toml.number(kKey, index, (*pair)[0], "where the zone begins, a number");
  if (!from) return fail(from.error());
  const auto speed = toml.number(kKey, index, (*pair)[1], "a speed above 0");
  if (!speed) return fail(speed.error());
  if (*speed > 0) return SpeedZones::Zone{*from, *speed};
  return fail(toml.error(kKey, index, fmt::format("has the speed {}; allowed: above 0", *speed)));
}

// Each zone, and then the end, lies further on in one direction.
Result<void> check_order(const TomlReader& toml, const SpeedZones& read) {
  const double first = read.zones.front().from;
  if (read.by == SpeedZones::By::kDistance && first != 0) {
    return fail(toml.error("zones", std::size_t{0},
                           fmt::format("begins at {}; allowed by distance: 0, where the motion "
                                       "begins",
                                       first)));
  }
  if (read.end == first) {
    return fail(toml.error("end", fmt::format("is {}, where the first zone begins; allowed: "
                                              "another place, in either direction",
                                              read.end)));
  }
  const bool up = read.end > first;
  const auto behind = [up](double from, double to) { return up ? to > from : to < from; };
  for (std::size_t i = 1; i < read.zones.size(); ++i) {
    const double from = read.zones[i - 1].from;
    const double to = read.zones[i].from;
    if (behind(from, to) && behind(to, read.end)) continue;
    return fail(toml.error(
        "zones", i,
        fmt::format("begins at {}; allowed: between {}, where the zone before begins, and the end, "
                    "{}",
                    to, from, read.end)));
  }
  if (const double way = std::fabs(read.steps_of(read.end) - read.steps_of(first));
      way > SpeedZones::kMostSteps) {
    return fail(toml.error("end", fmt::format("is {} steps from where the first zone begins; "
                                              "allowed: up to {}",
                                              way, SpeedZones::kMostSteps)));
  }
  for (const double place : {first, read.end}) {
    if (std::fabs(read.steps_of(place)) <= SpeedZones::kMostSteps) continue;
    return fail(toml.error(
        place == read.end ? "end" : "zones",
        fmt::format("leads to {}; allowed: up to {} steps from 0", place, SpeedZones::kMostSteps)));
  }
  return {};
}

Result<void> read_zones(const TomlReader& toml, SpeedZones& read) {
  const auto array = toml.array("zones", kZonesAllowed);
  if (!array) return fail(array.error());
  if ((*array)->empty() || (*array)->size() > SpeedZones::kMostZones) {
    return fail(toml.error(
        "zones", fmt::format("has {} zones; allowed: {}", (*array)->size(), kZonesAllowed)));
  }
  for (const toml::node& node : **array) {
    const auto zone = read_zone(toml, read.zones.size(), node);
    if (!zone) return fail(zone.error());
    read.zones.push_back(*zone);
  }
  return {};
}

}  // namespace

std::filesystem::path envelope_path(std::string_view envelope,
                                    const std::filesystem::path& directory) {
  const bool is_path =
      envelope.find('/') != std::string_view::npos || envelope.ends_with(kExtension);
  return is_path ? std::filesystem::path(envelope)
                 : directory / (std::string(envelope) + std::string(kExtension));
}

Result<SpeedZones> parse_zones(std::string_view text, const std::string& file) {
  const auto table = parse_toml(text, file);
  if (!table) return fail(table.error());
  const TomlReader toml(*table, file);
  SpeedZones read;
  Keys keys(toml);
  keys.only({"description", "table", "by", "steps_per_unit", "zones", "end"})
      .text("description", &read.description, "text");
  if (!keys.result()) return fail(keys.result().error());
  auto name = toml.string("table", "the name of a table");
  if (!name) return fail(name.error());
  if (name->empty()) return fail(toml.error("table", "is empty; allowed: the name of a table"));
  read.table = std::move(*name);
  static_assert(static_cast<int>(SpeedZones::By::kPosition) == 1);
  const auto above_0 = [](double scale) -> Result<void> {
    if (scale > 0) return {};
    return fail(fmt::format("is {}; allowed: a number above 0, that of the motor", scale));
  };
  keys.word("by", &read.by, {"distance", "position"})
      .number("steps_per_unit", &read.steps_per_unit, "a number above 0", above_0);
  if (!keys.result()) return fail(keys.result().error());
  const auto end = toml.number("end", "where the motion ends, a number");
  if (!end) return fail(end.error());
  read.end = *end;
  if (auto zones = read_zones(toml, read); !zones) return fail(zones.error());
  if (auto order = check_order(toml, read); !order) return fail(order.error());
  return read;
}

Result<SpeedZones> load_zones(const std::filesystem::path& path) {
  const auto text = read_text(path, kEnvelopeLimit);
  if (!text) return fail(text.error());
  return parse_zones(*text, path.string());
}

std::string to_text(const SpeedZones& zones) {
  std::string text;
  if (!zones.description.empty()) {
    text += fmt::format("description = {}\n", quoted_toml(zones.description));
  }
  text += fmt::format("table = {}\n", quoted_toml(zones.table));
  text +=
      fmt::format("by = \"{}\"\n", zones.by == SpeedZones::By::kDistance ? "distance" : "position");
  if (zones.steps_per_unit) text += fmt::format("steps_per_unit = {}\n", *zones.steps_per_unit);
  text += "zones = [\n";
  for (const SpeedZones::Zone& zone : zones.zones) {
    text += fmt::format("  [{}, {}],\n", zone.from, zone.speed);
  }
  return text + fmt::format("]\nend = {}\n", zones.end);
}

Result<void> check_speeds(const SpeedZones& zones, const bushd_table& table) {
  const double fastest_steps_per_s =
      1e9 / (static_cast<double>(bushd_table_fastest(&table)) * table.time_unit_ns);
  for (std::size_t i = 0; i < zones.zones.size(); ++i) {
    const double speed = zones.steps_of(zones.zones[i].speed);
    if (speed <= fastest_steps_per_s * kSameSpeed) continue;
    return fail(Error{
        .message = fmt::format("has {:.6g} steps/s, and the table \"{}\" reaches {:.6g}; use a "
                               "lower speed or a faster table",
                               speed, zones.table, fastest_steps_per_s),
        .key = fmt::format("zones[{}]", i)});
  }
  return {};
}

}  // namespace bushd::tables
