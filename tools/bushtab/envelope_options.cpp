#include <optional>
#include <string>
#include <string_view>

#include "base/parse_number.h"
#include "options.h"

namespace bushtab {
namespace {

using bushd::tables::SpeedZones;

std::optional<SpeedZones::Zone> zone_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto from = bushd::parse_number<double>(std::string_view(text).substr(0, colon));
  const auto speed = bushd::parse_number<double>(std::string_view(text).substr(colon + 1));
  if (!from || !speed || *speed <= 0) return std::nullopt;
  return SpeedZones::Zone{*from, *speed};
}

std::string refuse_no_zone(const std::string& value) {
  if (zone_of(value)) return {};
  return "\"" + value + "\" is not where a zone begins and a speed above 0; write FROM:SPEED";
}

std::string refuse_no_number(const std::string& value) {
  return bushd::parse_number<double>(value) ? std::string() : "\"" + value + "\" is not a number";
}

}  // namespace

void add_envelope_options(Commands& commands) {
  const auto [command, options] = commands.add<Envelope>(
      "envelope", "Make, change and draw an envelope: a move of several speeds that has a name",
      envelope);
  command->add_option("ENVELOPE", options->name, "An envelope's name, or a file NAME.envelope")
      ->required();
  add_value(command, "--table", options->table, "TABLE",
            "Table of its motor, beside it or shipped");
  command
      ->add_option_function<std::vector<std::string>>(
          "--zone",
          [&zones = options->zones](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) zones.push_back(*zone_of(text));
          },
          "From there on at most so fast per second; several, in the order of the way")
      ->check(refuse_no_zone)
      ->type_name("FROM:SPEED");
  add_value(command, "--end", options->end, "PLACE", "Where the motion ends")
      ->check(refuse_no_number);
  command
      ->add_option("--by", options->by,
                   "Places are distances from where the motion begins, or positions")
      ->check(CLI::IsMember({"distance", "position"}));
  add_value(command, "--steps-per-unit", options->steps_per_unit, "STEPS",
            "Numbers are in a unit of so many steps, as those of its motor (default: steps)")
      ->check(refuse_not_positive);
  add_value(command, "--description", options->description, "TEXT", "What it is for");
  command->add_flag("--replace", options->replace,
                    "Change what is given in an envelope that exists");
  command->add_flag("--json", options->json, "Print JSON");
  add_picture_options(command, options->svg, options->png);
  command->footer("Without changes it shows and draws the envelope.");
}

}  // namespace bushtab
