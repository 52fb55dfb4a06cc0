#include <charconv>
#include <limits>
#include <string>
#include <system_error>
#include <vector>

#include "base/parse_number.h"
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

void add_show(Commands& commands) {
  const auto [command, options] =
      commands.add<Show>("show", "Show speeds, times and sizes of a table", show);
  command->add_option("TABLE", options->table, kTable)->required();
  auto* const steps = command->add_flag(
      "--steps", options->steps,
      "Print every step of the move that just reaches cruise: delay, time, speed, acceleration");
  command
      ->add_option_function<std::string>(
          "--converter",
          [&converter = options->converter](const std::string& text) {
            converter = converter_of(text);
          },
          "With --steps, print the code K of each step too, for a voltage-to-frequency converter "
          "that gives MAX_HZ at the code MAX_CODE")
      ->type_name("MAX_HZ:MAX_CODE")
      ->check([](const std::string& text) -> std::string {
        return converter_of(text) ? "" : text + " is not MAX_HZ:MAX_CODE, such as 2500:250";
      })
      ->needs(steps);
  command->add_flag("--json", options->json, "Print JSON");
}

void add_check(Commands& commands) {
  const auto [command, options] =
      commands.add<Check>("check", "Check tables against rules, a motor and a bus", check);
  command->add_option("TABLE", options->tables, "Tables' files or names")->required();
  command->add_flag("--strict", options->strict, "Refuse tables with warnings too (exit code 1)");
  command->add_flag("--json", options->json, "Print JSON");
  add_limit_options(command, options->limits);
}

void add_list(Commands& commands) {
  const auto [command, json] =
      commands.add<bool>("list", "List all tables, shipped ones too", list);
  command->add_flag("--json", *json, "Print JSON");
}

void add_time(Commands& commands) {
  const auto [command, options] =
      commands.add<Times>("time", "Show how long moves take", bushtab::time);
  command->add_option("TABLE", options->table, kTable)->required();
  add_value(command, "--steps", options->steps, "N", "Lengths of the moves, in steps")
      ->required()
      ->check(whole_number(0, 2147483647));
  command->add_flag("--json", options->json, "Print JSON");
}

void add_plot(Commands& commands) {
  const auto [command, options] = commands.add<Plot>(
      "plot", "Draw tables in one picture, in the terminal or into files",
      [](const Places& places, const Plot& wanted) {
        const bool to_files = !wanted.svg.empty() || !wanted.png.empty();
        return to_files ? draw_pictures(places, wanted) : plot(places, wanted.tables);
      });
  command->add_option("TABLE", options->tables, "Tables' files or names")->required();
  add_picture_options(command, options->svg, options->png);
  command->footer(
      "In the terminal: speed over time, as wide as that is, else $COLUMNS, else 80. No colours\n"
      "with $NO_COLOR or in a file.");
}

void add_diff(Commands& commands) {
  const auto [command, options] =
      commands.add<Diff>("diff", "Compare two tables: a summary, then by step and by speed", diff);
  command->add_option("BEFORE", options->before, kTable)->required();
  command->add_option("AFTER", options->after, kTable)->required();
  command->add_flag("--json", options->json, "Print JSON");
}

void add_expand(Commands& commands) {
  const auto [command, options] = commands.add<Expansion>(
      "expand", "Print a move as CSV tick,displacement: exactly what the daemon would send",
      expand);
  command->footer(
      "Displacements of format coarse are the bytes on the bus: bit 7 is 1 if the motor goes\n"
      "forward, bits 6..0 count its steps in the tick: 130 is +2, 2 is -2. Those of format fine\n"
      "are signed, in 1/256 step: 512 is +2, -512 is -2.");
  constexpr std::int64_t kMaxSteps = std::numeric_limits<std::int32_t>::max();
  command->add_option("--table", options->table, kTable)->required()->type_name("TABLE");
  command->add_option("--steps", options->steps, "Length and direction of the move")
      ->required()
      ->check(whole_number(-kMaxSteps, kMaxSteps));
  command->add_option("--tick-us", options->tick_us, "Length of a tick in us")
      ->required()
      ->check(whole_number(BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000));
  command
      ->add_option_function<std::string>(
          "--format",
          [&format = options->format](const std::string& name) {
            format = name == "coarse" ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE;
          },
          "coarse (a byte) or fine (steps x 256)")
      ->required()
      ->check(CLI::IsMember({"coarse", "fine"}));
  command->add_option("--speed", options->speed, "Not faster than so many steps per second");
  command->add_flag("--json", options->json, "Print JSON");
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
  const auto number = bushd::parse_number<double>(value);
  return number && *number > 0 ? std::string() : value + " is not a number above 0";
}

void add_table_options(CLI::App* command, TableOptions& options, const std::string& json_help) {
  command->add_option("TABLE", options.table, kTable)->required();
  command->add_flag("--json", options.json, json_help);
}

void add_new_table(CLI::App* command, const std::string& name, std::string& table) {
  command->add_option(name, table, "The new table's name, or a file NAME.toml")->required();
}

void add_picture_options(CLI::App* command, std::string& svg, std::string& png) {
  add_value(command, "--svg", svg, "FILE",
            "Write speed over steps and time, and acceleration, as SVG");
  add_value(command, "--png", png, "FILE", "Write the same as PNG");
}

void add_limit_options(CLI::App* command, LimitOptions& options) {
  auto& limits = options.limits;
  add_quantity(command, "--start", Quantity::kSpeed, limits.start_hz,
               "Highest speed at which the motor can start and stop");
  add_quantity(command, "--max", Quantity::kSpeed, limits.max_hz, "Highest speed of the motor");
  add_quantity(command, "--acceleration", Quantity::kAcceleration, limits.acceleration,
               "Greatest acceleration");
  add_value(command, "--speed-ratio", limits.speed_ratio, "RATIO",
            "Greatest change of speed from one step to the next (default 2, with "
            "--torque any; 0: any)");
  add_value(command, "--code-bits", limits.code_bits, "8|16",
            "8: codes must be those of BUSHD-2, 10..250")
      ->check(CLI::IsMember({8, 16}));
  add_value(command, "--mcu-codes", limits.mcu_codes, "N", "Table memory of the MCU, in codes")
      ->check(whole_number(1, std::numeric_limits<std::uint32_t>::max()));
  command
      ->add_option_function<std::uint32_t>(
          "--tick-us", [&](const std::uint32_t& us) { limits.tick_ns = us * 1000; },
          "Tick of the bus")
      ->check(whole_number(BUSHD_MIN_TICK_NS / 1000, BUSHD_MAX_TICK_NS / 1000));
  command->add_option("--slots", limits.slots, "Slots of a tick, 128..256 (with --tick-us)")
      ->check(whole_number(128, 256));
  add_motor_options(command, options.motor);
}

void add_look_options(Commands& commands) {
  add_show(commands);
  add_check(commands);
  add_diff(commands);
  add_expand(commands);
  add_list(commands);
  add_plot(commands);
  add_time(commands);
}

}  // namespace bushtab
