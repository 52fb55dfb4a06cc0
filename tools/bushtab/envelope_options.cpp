#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "options.h"

namespace bushtab {
namespace {

using bushd::tables::SpeedZones;

std::optional<double> number_of(std::string_view text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<SpeedZones::Zone> zone_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto from = number_of(std::string_view(text).substr(0, colon));
  const auto speed = number_of(std::string_view(text).substr(colon + 1));
  if (!from || !speed || *speed <= 0) return std::nullopt;
  return SpeedZones::Zone{*from, *speed};
}

std::string refuse_no_zone(const std::string& value) {
  if (zone_of(value)) return {};
  return "\"" + value + "\" is not where a zone begins and a speed above 0; write FROM:SPEED";
}

std::string refuse_no_number(const std::string& value) {
  return number_of(value) ? std::string() : "\"" + value + "\" is not a number";
}

}  // namespace

void add_envelope_options(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<Envelope>();
  CLI::App* command = app.add_subcommand(
      "envelope", "Make, change and draw an envelope: a move of several speeds that has a name");
  command->add_option("ENVELOPE", options->name, "An envelope's name, or a file NAME.envelope")
      ->required();
  command->add_option("--table", options->table, "Table of its motor, beside it or shipped")
      ->type_name("TABLE");
  command
      ->add_option_function<std::vector<std::string>>(
          "--zone",
          [options](const std::vector<std::string>& zones) {
            for (const std::string& zone : zones) options->zones.push_back(*zone_of(zone));
          },
          "From there on at most so fast per second; several, in the order of the way")
      ->check(refuse_no_zone)
      ->type_name("FROM:SPEED");
  command->add_option("--end", options->end, "Where the motion ends")
      ->check(refuse_no_number)
      ->type_name("PLACE");
  command
      ->add_option("--by", options->by,
                   "Places are distances from where the motion begins, or positions")
      ->check(CLI::IsMember({"distance", "position"}));
  command
      ->add_option("--steps-per-unit", options->steps_per_unit,
                   "Numbers are in a unit of so many steps, as those of its motor (default: steps)")
      ->check(refuse_not_positive)
      ->type_name("STEPS");
  command->add_option("--description", options->description, "What it is for")->type_name("TEXT");
  command->add_flag("--replace", options->replace,
                    "Change what is given in an envelope that exists");
  command->add_flag("--json", options->json, "Print JSON");
  command
      ->add_option("--svg", options->svg,
                   "Write speed over steps and time, and acceleration, as SVG")
      ->type_name("FILE");
  command->add_option("--png", options->png, "Write the same as PNG")->type_name("FILE");
  command->footer("Without changes it shows and draws the envelope.");
  run(command, [&places, options] { return envelope(places, *options); });
}

}  // namespace bushtab
