#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "options.h"

namespace bushtab {
namespace {

using bushd::tables::profiles::Quantity;

std::optional<bushd::Converter> converter_of(const std::string& text) {
  bushd::Converter converter{};
  const char* const end = text.data() + text.size();
  const auto hz = std::from_chars(text.data(), end, converter.max_hz);
  if (hz.ec != std::errc{} || hz.ptr == end || *hz.ptr != ':') return std::nullopt;
  const auto code = std::from_chars(hz.ptr + 1, end, converter.max_code);
  if (code.ec != std::errc{} || code.ptr != end) return std::nullopt;
  return converter;
}

void add_show(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    std::string table;
    Show wanted;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* show = app.add_subcommand("show", "Show speeds, times and sizes of a table");
  show->add_option("TABLE", options->table, kTable)->required();
  auto* const steps = show->add_flag(
      "--steps", options->wanted.steps,
      "Print every step of the move that just reaches cruise: delay, time, speed, acceleration");
  show->add_option_function<std::string>(
          "--converter",
          [options](const std::string& text) { options->wanted.converter = converter_of(text); },
          "With --steps, print the code K of each step too, for a voltage-to-frequency converter "
          "that gives MAX_HZ at the code MAX_CODE")
      ->type_name("MAX_HZ:MAX_CODE")
      ->check([](const std::string& text) -> std::string {
        return converter_of(text) ? "" : text + " is not MAX_HZ:MAX_CODE, such as 2500:250";
      })
      ->needs(steps);
  show->add_flag("--json", options->wanted.json, "Print JSON");
  run(show, [&places, options] { return bushtab::show(places, options->table, options->wanted); });
}

void add_check(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<Check>();
  CLI::App* check = app.add_subcommand("check", "Check tables against rules, a motor and a bus");
  check->add_option("TABLE", options->tables, "Tables' files or names")->required();
  check->add_flag("--strict", options->strict, "Refuse tables with warnings too (exit code 1)");
  check->add_flag("--json", options->json, "Print JSON");
  add_limit_options(check, options->limits);
  run(check, [&places, options] { return bushtab::check(places, *options); });
}

void add_list(CLI::App& app, const Places& places, const Run& run) {
  const auto json = std::make_shared<bool>(false);
  CLI::App* list = app.add_subcommand("list", "List all tables, shipped ones too");
  list->add_flag("--json", *json, "Print JSON");
  run(list, [&places, json] { return bushtab::list(places, *json); });
}

void add_time(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    std::string table;
    std::vector<std::uint32_t> steps;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* time = app.add_subcommand("time", "Show how long moves take");
  time->add_option("TABLE", options->table, kTable)->required();
  time->add_option("--steps", options->steps, "Lengths of the moves, in steps")
      ->required()
      ->check(whole_number(0, 2147483647))
      ->type_name("N");
  time->add_flag("--json", options->json, "Print JSON");
  run(time, [&places, options] {
    return bushtab::time(places, options->table, options->steps, options->json);
  });
}

void add_plot(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<Plot>();
  CLI::App* plot =
      app.add_subcommand("plot", "Draw tables in one picture, in the terminal or into files");
  plot->add_option("TABLE", options->tables, "Tables' files or names")->required();
  plot->add_option("--svg", options->svg,
                   "Write speed over steps and time, and acceleration, as SVG")
      ->type_name("FILE");
  plot->add_option("--png", options->png, "Write the same as PNG")->type_name("FILE");
  plot->footer(
      "In the terminal: speed over time, as wide as that is, else $COLUMNS, else 80. No colours\n"
      "with $NO_COLOR or in a file.");
  run(plot, [&places, options] {
    const bool to_files = !options->svg.empty() || !options->png.empty();
    return to_files ? draw_pictures(places, *options) : bushtab::plot(places, options->tables);
  });
}

void add_diff(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    std::string before;
    std::string after;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* diff =
      app.add_subcommand("diff", "Compare two tables: a summary, then by step and by speed");
  diff->add_option("BEFORE", options->before, kTable)->required();
  diff->add_option("AFTER", options->after, kTable)->required();
  diff->add_flag("--json", options->json, "Print JSON");
  run(diff, [&places, options] {
    return bushtab::diff(places, options->before, options->after, options->json);
  });
}

void add_expand(CLI::App& app, const Places& places, const Run& run) {
  struct Options {
    Expansion expansion;
    std::string format;
  };
  const auto options = std::make_shared<Options>();
  Expansion& expansion = options->expansion;
  CLI::App* expand = app.add_subcommand(
      "expand", "Print a move as CSV tick,displacement: exactly what the daemon would send");
  expand->footer(
      "Displacements of format coarse are the bytes on the bus: bit 7 is 1 if the motor goes\n"
      "forward, bits 6..0 count its steps in the tick: 130 is +2, 2 is -2. Those of format fine\n"
      "are signed, in 1/256 step: 512 is +2, -512 is -2.");
  constexpr std::int64_t kMaxSteps = std::numeric_limits<std::int32_t>::max();
  expand->add_option("--table", expansion.table, kTable)->required()->type_name("TABLE");
  expand->add_option("--steps", expansion.steps, "Length and direction of the move")
      ->required()
      ->check(whole_number(-kMaxSteps, kMaxSteps));
  expand->add_option("--tick-us", expansion.tick_us, "Length of a tick in us")
      ->required()
      ->check(whole_number(BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000));
  expand->add_option("--format", options->format, "coarse (a byte) or fine (steps x 256)")
      ->required()
      ->check(CLI::IsMember({"coarse", "fine"}));
  expand->add_option("--speed", expansion.speed, "Not faster than so many steps per second");
  expand->add_flag("--json", expansion.json, "Print JSON");
  run(expand, [&places, options] {
    options->expansion.format =
        options->format == "coarse" ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE;
    return bushtab::expand(places, options->expansion);
  });
}

}  // namespace

std::function<std::string(const std::string&)> whole_number(std::int64_t least,
                                                            std::int64_t greatest,
                                                            const std::string& remedy) {
  return [=](const std::string& value) -> std::string {
    const bool plus = value.starts_with('+');
    const std::string_view digits = std::string_view(value).substr(plus ? 1 : 0);
    const std::string allowed =
        " to " + std::to_string(greatest) + (remedy.empty() ? std::string() : ", as " + remedy);
    std::int64_t number = 0;
    const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    const bool whole =
        parsed.ptr == digits.data() + digits.size() && parsed.ec != std::errc::invalid_argument;
    if (!whole) {
      return value + " is not a whole number; allowed: " + std::to_string(least) + allowed;
    }
    if (parsed.ec == std::errc{} && number >= least && number <= greatest) return {};
    return value + " is out of range; allowed: " + std::to_string(least) + allowed;
  };
}

std::string refuse_not_positive(const std::string& value) {
  double number = 0;
  const char* end = value.data() + value.size();
  const auto parsed = std::from_chars(value.data(), end, number);
  const bool positive =
      parsed.ec == std::errc{} && parsed.ptr == end && std::isfinite(number) && number > 0;
  return positive ? std::string() : value + " is not a number above 0";
}

void add_limit_options(CLI::App* command, LimitOptions& options) {
  auto& limits = options.limits;
  add_quantity(
      command, "--start", Quantity::kSpeed, [&](double hz) { limits.start_hz = hz; },
      "Highest speed at which the motor can start and stop");
  add_quantity(
      command, "--max", Quantity::kSpeed, [&](double hz) { limits.max_hz = hz; },
      "Highest speed of the motor");
  add_quantity(
      command, "--acceleration", Quantity::kAcceleration,
      [&](double value) { limits.acceleration = value; }, "Greatest acceleration");
  command
      ->add_option("--speed-ratio", limits.speed_ratio,
                   "Greatest change of speed from one step to the next (default 2, with "
                   "--torque any; 0: any)")
      ->type_name("RATIO");
  command->add_option("--code-bits", limits.code_bits, "8: codes must be those of BUSHD-2, 10..250")
      ->check(CLI::IsMember({8, 16}))
      ->type_name("8|16");
  command->add_option("--mcu-codes", limits.mcu_codes, "Table memory of the MCU, in codes")
      ->check(whole_number(1, std::numeric_limits<std::uint32_t>::max()))
      ->type_name("N");
  command
      ->add_option_function<std::uint32_t>(
          "--tick-us", [&](const std::uint32_t& us) { limits.tick_ns = us * 1000; },
          "Tick of the bus")
      ->check(whole_number(BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000));
  command->add_option("--slots", limits.slots, "Slots of a tick, 128..256 (with --tick-us)")
      ->check(whole_number(128, 256));
  add_motor_options(command, options.motor);
}

void add_look_options(CLI::App& app, const Places& places, const Run& run) {
  add_show(app, places, run);
  add_check(app, places, run);
  add_diff(app, places, run);
  add_expand(app, places, run);
  add_list(app, places, run);
  add_plot(app, places, run);
  add_time(app, places, run);
}

}  // namespace bushtab
