#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "options.h"

namespace bushtab {
namespace {

namespace profiles = bushd::tables::profiles;
using profiles::Quantity;

double quantity_or_throw(const std::string& option, Quantity quantity, const std::string& text) {
  const auto value = profiles::parse_quantity(quantity, text);
  if (!value) throw CLI::ValidationError(option, value.error().message);
  return *value;
}

// "LEFT:RIGHT"
std::pair<std::string, std::string> halves(const std::string& option, const std::string& text,
                                           const char* form) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) {
    throw CLI::ValidationError(option, "\"" + text + "\"; allowed: " + form);
  }
  return {text.substr(0, colon), text.substr(colon + 1)};
}

// `prefix` is "" or "decel-".
void add_side_options(CLI::App* command, const std::string& prefix, profiles::SideSpec& side) {
  const std::string of = prefix.empty() ? "" : " of the decelerating side";
  const std::string dashes = "--" + prefix;
  const std::vector<std::string> names{"constant", "recurrence",  "v64",
                                       "scurve",   "exponential", "pto",
                                       "torque",   "piecewise",   "serial"};
  auto* profile = command->add_option_function<std::string>(
      dashes + "law",
      [&side](const std::string& name) { side.profile = *profiles::profile_of(name); },
      "Acceleration profile" + of);
  profile->check(CLI::IsMember(names));
  if (prefix.empty()) profile->required();
  add_quantity(command, dashes + "acceleration", Quantity::kAcceleration, side.acceleration,
               "Greatest acceleration" + of);
  add_quantity(command, dashes + "time", Quantity::kTime, side.time_s,
               "Time between start (or stop) and maximum speed" + of);
  add_value(command, dashes + "codes", side.codes, "N", "Number of codes" + of)
      ->check(whole_number(3, bushd::tables::kMaxCodes));
  add_quantity(command, dashes + "jerk", Quantity::kJerk, side.jerk,
               "scurve: greatest change of acceleration a second" + of);
  add_value(command, dashes + "fall", side.fall, "RATIO",
            "exponential: acceleration at start divided by that at the top (default 5)" + of);
  const std::string segment = dashes + "segment";
  command
      ->add_option_function<std::vector<std::string>>(
          segment,
          [&side, segment](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto [steps, speed] = halves(segment, text, "STEPS:SPEED");
              side.legs.push_back({quantity_or_throw(segment, Quantity::kSpeed, steps),
                                   quantity_or_throw(segment, Quantity::kSpeed, speed)});
            }
          },
          "piecewise: over STEPS steps go to SPEED, once for each segment" + of)
      ->allow_extra_args(false)
      ->type_name("STEPS:SPEED");
}

profiles::Skip& skip_of(profiles::Spec& spec) {
  if (!spec.skip) spec.skip.emplace();
  return *spec.skip;
}

void add_speed_options(CLI::App* command, profiles::Spec& spec) {
  add_quantity(command, "--start", Quantity::kSpeed, spec.start_hz,
               "Speed of the first step: what the motor can do from rest")
      ->required();
  add_quantity(command, "--max", Quantity::kSpeed, spec.max_hz, "Maximum speed")->required();
  add_quantity(command, "--stop", Quantity::kSpeed, spec.stop_hz,
               "Speed of the last step (default: that of the first)");
  command
      ->add_option_function<std::string>(
          "--skip",
          [&](const std::string& text) {
            const auto [low, high] = halves("--skip", text, "LO:HI");
            skip_of(spec).low_hz = quantity_or_throw("--skip", Quantity::kSpeed, low);
            skip_of(spec).high_hz = quantity_or_throw("--skip", Quantity::kSpeed, high);
          },
          "Band of speeds to pass quickly and not to cruise in (resonance) [" +
              profiles::units_text(Quantity::kSpeed) + "]")
      ->type_name("LO:HI");
  command
      ->add_option_function<std::string>(
          "--skip-acceleration",
          [&](const std::string& text) {
            if (text.starts_with('x')) {
              skip_of(spec).factor =
                  quantity_or_throw("--skip-acceleration", Quantity::kSpeed, text.substr(1));
            } else {
              skip_of(spec).acceleration =
                  quantity_or_throw("--skip-acceleration", Quantity::kAcceleration, text);
            }
          },
          "Acceleration in that band, or xFACTOR times that of the profile; default: all that the "
          "motor of --torque has")
      ->type_name("ACCELERATION|xFACTOR");
}

void add_code_options(CLI::App* command, profiles::Spec& spec) {
  add_time_unit(command, spec.time_unit_ns,
                "Time unit of the codes (default: the finest that fits)");
  add_value(command, "--code-bits", spec.code_bits, "8|16",
            "Width of a code: 16 (default), or 8 as BUSHD: codes 10..255, so that a code "
            "more or less changes the speed by 10 % at most");
  command->add_flag("--published", spec.published,
                    "recurrence, v64: divisions rounded down as in the source, so up to one time "
                    "unit faster than asked");
}

}  // namespace

CLI::Option* add_quantity(CLI::App* command, const std::string& name, Quantity quantity,
                          std::function<void(double)> set, const std::string& help) {
  static constexpr std::array<const char*, 7> kTypes{"SPEED", "ACCELERATION", "JERK",   "TIME",
                                                     "TIME",  "TORQUE",       "INERTIA"};
  return command
      ->add_option_function<std::string>(
          name,
          [name, quantity, set](const std::string& text) {
            set(quantity_or_throw(name, quantity, text));
          },
          help + " [" + profiles::units_text(quantity) + "]")
      ->type_name(kTypes.at(static_cast<std::size_t>(quantity)));
}

void add_time_unit(CLI::App* command, std::optional<std::uint32_t>& ns, const std::string& help) {
  auto set = [&ns](double value) {
    if (value < 1 || value > bushd::tables::kMaxTimeUnitNs || value != std::floor(value)) {
      throw CLI::ValidationError("--time-unit", "allowed: whole ns, 1ns..1s");
    }
    ns = static_cast<std::uint32_t>(value);
  };
  add_quantity(command, "--time-unit", Quantity::kTimeUnit, std::move(set), help);
}

namespace {

void add_load_options(CLI::App* command, LoadOptions& load) {
  const auto add = [command](const char* name, std::optional<double>& value, const char* type,
                             const char* help) {
    add_value(command, name, value, type, help)->check(refuse_not_positive);
  };
  add("--mass-kg", load.mass_kg, "KG",
      "Mass that a screw or a belt moves; with --lead-mm or --belt-mm");
  add("--lead-mm", load.lead_mm, "MM", "Lead of the screw: travel of the mass in one turn of it");
  add("--belt-mm", load.belt_mm, "MM",
      "Travel of the belt in one turn of its pulley: teeth times their pitch");
  add_quantity(command, "--load-inertia", Quantity::kInertia, load.inertia_kgm2,
               "Inertia of a load that turns, such as a rotary table, at its own axis");
  add("--gear", load.gear, "RATIO",
      "Turns of the motor for one turn of screw, pulley or turning load (default 1)");
}

}  // namespace

void add_motor_options(CLI::App* command, MotorOptions& options) {
  add_value(command, "--torque", options.torque_file, "FILE",
            "CSV of pull-out torque against speed: header speed_hz|speed_rpm,"
            "torque_nm|torque_ncm|torque_mnm; speed_hz counts microsteps, as all speeds here");
  profiles::Motor& motor = options.motor;
  add_quantity(command, "--inertia", Quantity::kInertia, motor.inertia_kgm2,
               "Inertia of the rotor, and of the load as far as no other option states it");
  add_load_options(command, options.load);
  add_quantity(command, "--friction", Quantity::kTorque, motor.friction_nm,
               "Torque of friction and load against the motion (default 0)");
  add_quantity(command, "--brake-friction", Quantity::kTorque, motor.brake_friction_nm,
               "Part of the friction that surely helps braking (default 0)");
  add_value(command, "--safety", motor.safety, "FACTOR",
            "Safety factor: torque of the motor / torque used (default 2)");
  add_value(command, "--steps-per-turn", motor.steps_per_turn, "N",
            "Steps of a turn, microsteps included (default 200)")
      ->check(refuse_not_positive);
  add_value(command, "--full-steps-per-turn", motor.full_steps_per_turn, "N",
            "Full steps of a turn, for the jumps of speed that the rotor can follow (default 200)")
      ->check(refuse_not_positive);
}

namespace {

// What is not said of the decelerating side is as on the other; how steep it is counts as one.
struct NewOptions : New {
  profiles::SideSpec decel;
  const CLI::App* command = nullptr;

  bool given(const std::string& option) const { return command->count(option) > 0; }
};

int make_two_sided(const Places& places, const NewOptions& options) {
  New wanted = options;
  const auto of_decel = [](const CLI::Option* option) {
    return option->count() > 0 && option->get_name().starts_with("--decel-");
  };
  if (std::ranges::any_of(options.command->get_options(), of_decel)) {
    const profiles::SideSpec& accel = wanted.spec.accel;
    profiles::SideSpec side = options.decel;
    if (!options.given("--decel-law")) side.profile = accel.profile;
    if (!options.given("--decel-fall")) side.fall = accel.fall;
    if (!side.acceleration && !side.time_s && !side.codes && side.profile == accel.profile) {
      side.acceleration = accel.acceleration;
      side.time_s = accel.time_s;
      side.codes = accel.codes;
    }
    wanted.spec.decel = side;
  }
  return make_new(places, wanted);
}

}  // namespace

void add_new_options(Commands& commands) {
  const auto [command, options] =
      commands.add<NewOptions>("new", "Make a table from an acceleration profile", make_two_sided);
  options->command = command;
  add_new_table(command, "TABLE", options->table);
  profiles::Spec& spec = options->spec;
  add_side_options(command, "", spec.accel);
  add_speed_options(command, spec);
  add_side_options(command, "decel-", options->decel);
  add_motor_options(command, options->motor);
  add_code_options(command, spec);
  command->add_option("--description", spec.description, "Motor and load that the table is for");
  command->add_option("--comment", options->comments, "Comment at the head of the file")
      ->allow_extra_args(false);
  auto* print = command->add_flag("--print", options->print,
                                  "Print the table instead of writing it: no file, no history");
  command->add_flag("--replace", options->replace, "Make a new revision if the table exists");
  command->add_flag("--json", options->json, "Print the table as show --json does")
      ->excludes(print);
}

void add_wizard_options(Commands& commands) {
  const auto [command, options] = commands.add<Wizard>(
      "wizard", "Ask for a profile as PLC wizards do, draw it, and make a table of it", wizard);
  add_new_table(command, "TABLE", options->table);
  command->add_flag("--replace", options->replace, "Make a new revision if the table exists");
}

}  // namespace bushtab
