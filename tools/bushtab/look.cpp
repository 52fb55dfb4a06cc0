// list, time and diff.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "base/printable.h"
#include "commands.h"
#include "json.h"
#include "open_table.h"
#include "tables/move_time.h"
#include "tables/table_file.h"

namespace bushtab {
namespace {

namespace tables = bushd::tables;
using nlohmann::ordered_json;

constexpr int kSpeedsCompared = 10;

double hz(const tables::Table& table, std::uint16_t code) {
  return 1e9 / (static_cast<double>(code) * table.view().time_unit_ns);
}

// How a side gets to a speed: the steps before it is reached, and their time.
struct Reached {
  std::uint32_t steps = 0;
  double ms = 0;
};

Reached reach(const tables::Table& table, double speed_hz) {
  const bushd_table& view = table.view();
  Reached reached;
  for (std::uint32_t i = 0; i < view.accel.count && hz(table, view.accel.code[i]) < speed_hz; ++i) {
    ++reached.steps;
    reached.ms += view.accel.code[i] * 1e-6 * view.time_unit_ns;
  }
  return reached;
}

// What a reader wants to know first: how much differs, and where the ends are.
ordered_json summary_of(const tables::Table& before, const tables::Table& after,
                        std::size_t differing) {
  const auto of = [](const tables::Table& table) -> ordered_json {
    const bushd_table& view = table.view();
    const auto ramp_ms = [&](const bushd_ramp& side) {
      double units = 0;
      for (std::uint32_t i = 0; i < side.count; ++i) units += side.code[i];
      return units * view.time_unit_ns * 1e-6;
    };
    return {{"start_steps_per_s", hz(table, view.accel.code[0])},
            {"max_steps_per_s", hz(table, bushd_table_fastest(&view))},
            {"accel_codes", view.accel.count},
            {"accel_ms", ramp_ms(view.accel)},
            {"decel_codes", view.decel.count},
            {"decel_ms", ramp_ms(view.decel)},
            {"time_unit_ns", view.time_unit_ns}};
  };
  return {{"delays_that_differ", differing}, {"before", of(before)}, {"after", of(after)}};
}

void print_summary(const ordered_json& summary) {
  const auto line = [&](const char* what, const char* key, const char* unit) {
    const double before = summary["before"][key].get<double>();
    const double after = summary["after"][key].get<double>();
    if (before == after) {
      fmt::print("  {:<14} {:>10.6g} {} in both\n", what, before, unit);
    } else {
      fmt::print("  {:<14} {:>10.6g} to {:.6g} {} ({:+.1f} %)\n", what, before, after, unit,
                 100 * (after / before - 1));
    }
  };
  const auto differing = summary["delays_that_differ"].get<std::size_t>();
  fmt::print("{} delay{} differ{}\n", differing, differing == 1 ? "" : "s",
             differing == 1 ? "s" : "");
  line("start speed", "start_steps_per_s", "steps/s");
  line("top speed", "max_steps_per_s", "steps/s");
  line("acceleration", "accel_ms", "ms");
  line("", "accel_codes", "codes");
  line("deceleration", "decel_ms", "ms");
  line("", "decel_codes", "codes");
  line("time unit", "time_unit_ns", "ns");
}

}  // namespace

int list(const Places& places, bool json) {
  ordered_json all = ordered_json::array();
  std::set<std::string> seen;
  int result = kDone;
  if (!json) {
    fmt::print("{:<24} {:>3}  {:<8}  {:>7}..{:<7} {:<7}  {}\n", "TABLE", "REV", "HASH", "START",
               "MAX", "STEPS/S", "DESCRIPTION");
  }
  for (const auto& directory : directories(places)) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
      const std::string name = entry.path().stem().string();
      if (entry.path().extension() == ".toml" && !name.starts_with('.')) {
        files.push_back(entry.path());
      }
    }
    std::sort(files.begin(), files.end());
    for (const auto& path : files) {
      const std::string name = path.stem().string();
      if (!seen.insert(name).second) continue;  // hidden by one of an earlier directory
      const auto table = tables::load(path);
      if (!table) {
        result = refuse(table.error());
        continue;
      }
      const bushd_table& view = (*table)->view();
      const double start_hz = hz(**table, view.accel.code[0]);
      const double max_hz = hz(**table, bushd_table_fastest(&view));
      all.push_back({{"name", name},
                     {"path", path.string()},
                     {"revision", (*table)->revision()},
                     {"sha256", (*table)->content_hash()},
                     {"start_steps_per_s", start_hz},
                     {"max_steps_per_s", max_hz},
                     {"description", (*table)->description()}});
      if (json) continue;
      fmt::print("{:<24} {:>3}  {}  {:>7.6g}..{:<7.6g} steps/s  {}\n", bushd::printable(name),
                 (*table)->revision(), (*table)->short_hash(), start_hz, max_hz,
                 bushd::printable((*table)->description()));
    }
  }
  if (json) print_json(all);
  return result;
}

int time(const Places& places, const Times& wanted) {
  const auto table = open_table(places, wanted.table);
  if (!table) return refuse(table.error());
  ordered_json all = ordered_json::array();
  for (const std::uint32_t count : wanted.steps) {
    const auto move = tables::move_time((*table)->view(), count);
    const double peak = move.fastest_code == 0 ? 0.0 : hz(**table, move.fastest_code);
    all.push_back({{"steps", count}, {"time_ns", move.time_ns}, {"peak_steps_per_s", peak}});
    if (!wanted.json) {
      fmt::print("{:>10} steps  {:>14.3f} ms  up to {:.6g} steps/s\n", count,
                 static_cast<double>(move.time_ns) * 1e-6, peak);
    }
  }
  if (wanted.json) print_json(all);
  return kDone;
}

int diff(const Places& places, const Diff& wanted) {
  const auto before = open_table(places, wanted.before);
  if (!before) return refuse(before.error());
  const auto after = open_table(places, wanted.after);
  if (!after) return refuse(after.error());
  const bushd_table& a = (*before)->view();
  const bushd_table& b = (*after)->view();
  const bool same = (*before)->content_hash() == (*after)->content_hash();

  ordered_json by_step = ordered_json::array();
  const auto compare = [&](const char* side, const bushd_ramp& old_side,
                           const bushd_ramp& new_side) {
    for (std::uint32_t i = 0; i < std::max(old_side.count, new_side.count); ++i) {
      const auto delay_us = [i](const bushd_ramp& ramp, const bushd_table& table) {
        const std::uint16_t code =
            i < ramp.count ? std::max(ramp.code[i], table.cruise) : table.cruise;
        return code * 1e-3 * table.time_unit_ns;
      };
      const double old_us = delay_us(old_side, a);
      const double new_us = delay_us(new_side, b);
      if (old_us == new_us) continue;
      by_step.push_back(
          {{"side", side}, {"steps_from_rest", i}, {"before_us", old_us}, {"after_us", new_us}});
    }
  };
  compare("accel", a.accel, b.accel);
  compare("decel", a.decel, b.decel);

  ordered_json by_speed = ordered_json::array();
  const double low = std::min(hz(**before, a.accel.code[0]), hz(**after, b.accel.code[0]));
  const double high =
      std::max(hz(**before, bushd_table_fastest(&a)), hz(**after, bushd_table_fastest(&b)));
  for (int i = 0; i <= kSpeedsCompared; ++i) {
    const double speed_hz = low + (high - low) * i / kSpeedsCompared;
    const auto entry = [&](const tables::Table& table) -> ordered_json {
      if (hz(table, bushd_table_fastest(&table.view())) < speed_hz * (1 - 1e-9)) return nullptr;
      const Reached reached = reach(table, speed_hz * (1 - 1e-9));
      return {{"steps", reached.steps}, {"ms", reached.ms}};
    };
    by_speed.push_back(
        {{"steps_per_s", speed_hz}, {"before", entry(**before)}, {"after", entry(**after)}});
  }
  const ordered_json summary = summary_of(**before, **after, by_step.size());
  if (wanted.json) {
    print_json({{"same_content", same},
                {"summary", summary},
                {"by_step", by_step},
                {"by_speed", by_speed}});
    return kDone;
  }
  if (same) {
    fmt::print("the same content, {}\n", (*before)->short_hash());
    return kDone;
  }
  print_summary(summary);
  fmt::print("delays that differ (side, steps from rest, us before, us after):\n");
  for (const auto& line : by_step) {
    fmt::print("  {} {:>6} {:>14.3f} {:>14.3f}\n", line["side"].get<std::string>(),
               line["steps_from_rest"].get<std::uint32_t>(), line["before_us"].get<double>(),
               line["after_us"].get<double>());
  }
  fmt::print("to reach a speed (steps/s; steps and ms before, after):\n");
  for (const auto& line : by_speed) {
    const auto text = [](const ordered_json& reached) {
      if (reached.is_null()) return fmt::format("{:>8} {:>12}", "never", "");
      return fmt::format("{:>8} {:>12.3f}", reached["steps"].get<std::uint32_t>(),
                         reached["ms"].get<double>());
    };
    fmt::print("  {:>10.6g} {} {}\n", line["steps_per_s"].get<double>(), text(line["before"]),
               text(line["after"]));
  }
  return kDone;
}

}  // namespace bushtab
