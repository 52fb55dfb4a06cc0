#include <fmt/core.h>

#include "base/printable.h"
#include "commands.h"
#include "curve.h"
#include "engine/run.h"
#include "json.h"
#include "open_table.h"

namespace bushtab {
namespace {

using bushd::tables::Table;
using nlohmann::ordered_json;

double steps_per_s(const Table& table, std::uint16_t code) {
  return 1e9 / (static_cast<double>(code) * table.view().time_unit_ns);
}

std::uint64_t ramp_ns(const Table& table, const bushd_ramp& side) {
  return std::uint64_t{side.sum[side.count]} * table.view().time_unit_ns;
}

// The first index from which a side does not slow the motor below cruise.
std::uint64_t codes_above_cruise(const bushd_ramp& side, std::uint16_t cruise) {
  std::uint64_t count = 0;
  while (count < side.count && side.code[count] > cruise) ++count;
  return count;
}

std::uint64_t shortest_cruising_move(const bushd_table& table) {
  return codes_above_cruise(table.accel, table.cruise) +
         codes_above_cruise(table.decel, table.cruise) + 1;
}

// 0: not even the shortest one.
std::uint64_t longest_tick_us(const bushd_table& table) {
  const std::uint64_t shortest_ns = std::uint64_t{table.time_unit_ns} * bushd_table_fastest(&table);
  const std::uint64_t tick_ns = shortest_ns * BUSHD_MAX_STEPS_PER_TICK - 1;
  if (tick_ns < BUSHD_MIN_TICK_NS) return 0;
  return (tick_ns > BUSHD_MAX_TICK_NS ? BUSHD_MAX_TICK_NS : tick_ns) / 1000;
}

ordered_json side_json(const Table& table, const bushd_ramp& side) {
  const std::uint16_t slowest = side.code[0];
  const std::uint16_t fastest = side.code[side.count - 1];
  return {{"codes", side.count},
          {"slowest_code", slowest},
          {"fastest_code", fastest},
          {"slowest_steps_per_s", steps_per_s(table, slowest)},
          {"fastest_steps_per_s", steps_per_s(table, fastest)},
          {"time_ns", ramp_ns(table, side)}};
}

const char* word_of(CurveStep::Part part) {
  switch (part) {
    case CurveStep::Part::kAccel:
      return "accel";
    case CurveStep::Part::kCruise:
      return "cruise";
    case CurveStep::Part::kDecel:
      break;
  }
  return "decel";
}

using WantedConverter = std::optional<bushd::Converter>;

ordered_json steps_json(const std::vector<CurveStep>& curve, const WantedConverter& converter) {
  ordered_json steps = ordered_json::array();
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const CurveStep& step = curve[i];
    steps.push_back({{"step", i + 1},
                     {"part", word_of(step.part)},
                     {"index", step.index},
                     {"delay_ns", step.delay_ns},
                     {"time_ns", step.time_ns},
                     {"steps_per_s", step.speed_hz()},
                     {"steps_per_s2", nullptr}});
    if (i > 0) steps.back()["steps_per_s2"] = acceleration(curve[i - 1], step);
    if (converter) {
      steps.back()["converter_code"] = bushd::converter_code(*converter, step.delay_ns);
    }
  }
  return steps;
}

void print_steps(const std::vector<CurveStep>& curve, const WantedConverter& converter) {
  fmt::print("\n{:>6}  {:<6} {:>6} {:>14} {:>14} {:>12} {:>14}{}\n", "step", "part", "index",
             "delay us", "time ms", "steps/s", "steps/s²", converter ? "    K" : "");
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const CurveStep& step = curve[i];
    const std::string change =
        i == 0 ? "-" : fmt::format("{:.6g}", acceleration(curve[i - 1], step));
    const std::string code =
        converter ? fmt::format(" {:>4}", bushd::converter_code(*converter, step.delay_ns)) : "";
    fmt::print("{:>6}  {:<6} {:>6} {:>14.3f} {:>14.6f} {:>12.6g} {:>14}{}\n", i + 1,
               word_of(step.part), step.index, static_cast<double>(step.delay_ns) * 1e-3,
               static_cast<double>(step.time_ns) * 1e-6, step.speed_hz(), change, code);
  }
}

void print_as_json(const Table& table, bool steps, const WantedConverter& converter) {
  const bushd_table& view = table.view();
  ordered_json json = {
      {"name", table.name()},
      {"description", table.description()},
      {"path", table.path()},
      {"revision", table.revision()},
      {"sha256", table.content_hash()},
      {"time_unit_ns", view.time_unit_ns},
      {"symmetric", table.symmetric()},
      {"accel", side_json(table, view.accel)},
      {"decel", side_json(table, view.decel)},
      {"cruise", {{"code", view.cruise}, {"steps_per_s", steps_per_s(table, view.cruise)}}},
      {"shortest_cruising_move_steps", shortest_cruising_move(view)},
      {"longest_tick_us", longest_tick_us(view)}};
  if (steps) json["steps"] = steps_json(curve_of(table), converter);
  print_json(json);
}

std::string side_text(const Table& table, const bushd_ramp& side) {
  const std::uint16_t slowest = side.code[0];
  const std::uint16_t fastest = side.code[side.count - 1];
  return fmt::format("{} codes {}..{}, {:.6g}..{:.6g} steps/s, {:.3f} ms", side.count, slowest,
                     fastest, steps_per_s(table, slowest), steps_per_s(table, fastest),
                     static_cast<double>(ramp_ns(table, side)) * 1e-6);
}

void print_text(const Table& table) {
  const bushd_table& view = table.view();
  fmt::print("{} ({})\n", bushd::printable(table.name()), bushd::printable(table.path()));
  if (!table.description().empty()) fmt::print("{}\n", bushd::printable(table.description()));
  fmt::print("\n  revision      {}, content {}\n",
             table.revision() > 0 ? fmt::format("{}", table.revision()) : "none",
             table.short_hash());
  fmt::print("  time unit     {} ns\n", view.time_unit_ns);
  fmt::print("  acceleration  {}\n", side_text(table, view.accel));
  fmt::print("  deceleration  {}\n",
             table.symmetric() ? "the same, reversed" : side_text(table, view.decel));
  fmt::print("  cruise        code {}, {:.6g} steps/s, reached by moves of {} steps or more\n",
             view.cruise, steps_per_s(table, view.cruise), shortest_cruising_move(view));
  if (const std::uint64_t tick_us = longest_tick_us(view)) {
    fmt::print("  ticks         up to {} us ({} steps a tick at most)\n", tick_us,
               BUSHD_MAX_STEPS_PER_TICK);
  } else {
    fmt::print("  ticks         too fast for any: more than {} steps in the shortest tick\n",
               BUSHD_MAX_STEPS_PER_TICK);
  }
}

// As the configuration of a bus that has it is refused.
bushd::Result<void> keeps(const Table& table, const bushd::Converter& converter) {
  if (converter.max_code == 0 || converter.max_code > bushd::kMaxConverterCode ||
      converter.max_hz > bushd::kMaxConverterHz ||
      converter.max_hz < bushd::kLeastHzPerCode * converter.max_code) {
    return bushd::fail(fmt::format(
        "--converter {}:{}: allowed is a MAX_CODE of 1..{}, and a MAX_HZ of {} times it to {}",
        converter.max_hz, converter.max_code, bushd::kMaxConverterCode, bushd::kLeastHzPerCode,
        bushd::kMaxConverterHz));
  }
  const bushd_table& view = table.view();
  const std::uint64_t fastest_ns = std::uint64_t{view.time_unit_ns} * bushd_table_fastest(&view);
  if (bushd::converter_period_ns(converter, converter.max_code) <= fastest_ns) return {};
  return bushd::fail(
      fmt::format("the table has steps {} ns apart, and the converter gives no more than {} "
                  "pulses/s: use a slower table, or a converter with a higher MAX_HZ",
                  fastest_ns, converter.max_hz));
}

}  // namespace

int show(const Places& places, const Show& wanted) {
  const auto table = open_table(places, wanted.table);
  if (!table) return refuse(table.error());
  if (wanted.converter) {
    const auto kept = keeps(**table, *wanted.converter);
    if (!kept) return refuse(kept.error());
  }
  if (wanted.json) {
    print_as_json(**table, wanted.steps, wanted.converter);
  } else {
    print_text(**table);
    if (wanted.steps) print_steps(curve_of(**table), wanted.converter);
  }
  return kDone;
}

int saved(const Home& home, const bushd::Result<std::uint32_t>& revision, bool json) {
  if (!revision) return refuse(revision.error());
  const std::string path = home.store.path_of(home.name).string();
  if (json) return show(Places{}, {{path, true}});
  fmt::print("{}: revision {}\n", bushd::printable(path), *revision);
  return kDone;
}

}  // namespace bushtab
