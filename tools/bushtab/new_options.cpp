#include <array>
#include <cmath>
#include <memory>
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

// `prefix` is "" or "decel-". `side` gives the side to be set.
void add_side_options(CLI::App* command, const std::string& prefix,
                      const std::function<profiles::SideSpec&()>& side) {
  const std::string of = prefix.empty() ? "" : " of the decelerating side";
  const std::string dashes = "--" + prefix;
  const std::vector<std::string> names{"constant", "recurrence",  "v64",
                                       "scurve",   "exponential", "pto",
                                       "torque",   "piecewise",   "serial"};
  auto* profile = command->add_option_function<std::string>(
      dashes + "law",
      [side](const std::string& name) { side().profile = *profiles::profile_of(name); },
      "Acceleration profile" + of);
  profile->check(CLI::IsMember(names));
  if (prefix.empty()) profile->required();
  add_quantity(
      command, dashes + "acceleration", Quantity::kAcceleration,
      [side](double value) { side().acceleration = value; }, "Greatest acceleration" + of);
  add_quantity(
      command, dashes + "time", Quantity::kTime, [side](double value) { side().time_s = value; },
      "Time between start (or stop) and maximum speed" + of);
  command
      ->add_option_function<std::uint32_t>(
          dashes + "codes", [side](const std::uint32_t& value) { side().codes = value; },
          "Number of codes" + of)
      ->check(whole_number(3, bushd::tables::kMaxCodes))
      ->type_name("N");
  add_quantity(
      command, dashes + "jerk", Quantity::kJerk, [side](double value) { side().jerk = value; },
      "scurve: greatest change of acceleration a second" + of);
  command
      ->add_option_function<double>(
          dashes + "fall", [side](const double& value) { side().fall = value; },
          "exponential: acceleration at start divided by that at the top (default 5)" + of)
      ->type_name("RATIO");
  const std::string segment = dashes + "segment";
  command
      ->add_option_function<std::vector<std::string>>(
          segment,
          [side, segment](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto [steps, speed] = halves(segment, text, "STEPS:SPEED");
              side().legs.push_back({quantity_or_throw(segment, Quantity::kSpeed, steps),
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
  add_quantity(
      command, "--start", Quantity::kSpeed, [&](double hz) { spec.start_hz = hz; },
      "Speed of the first step: what the motor can do from rest")
      ->required();
  add_quantity(
      command, "--max", Quantity::kSpeed, [&](double hz) { spec.max_hz = hz; }, "Maximum speed")
      ->required();
  add_quantity(
      command, "--stop", Quantity::kSpeed, [&](double hz) { spec.stop_hz = hz; },
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
  add_quantity(
      command, "--time-unit", Quantity::kTimeUnit,
      [&](double ns) {
        if (ns < 1 || ns > bushd::tables::kMaxTimeUnitNs || ns != std::floor(ns)) {
          throw CLI::ValidationError("--time-unit", "allowed: whole ns, 1ns..1s");
        }
        spec.time_unit_ns = static_cast<std::uint32_t>(ns);
      },
      "Time unit of the codes (default: the finest that fits)");
  command
      ->add_option("--code-bits", spec.code_bits,
                   "Width of a code: 16 (default), or 8 as BUSHD: codes 10..255, so that a code "
                   "more or less changes the speed by 10 % at most")
      ->type_name("8|16");
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

namespace {

void add_load_options(CLI::App* command, LoadOptions& load) {
  const auto add = [command](const char* name, std::optional<double>& value, const char* type,
                             const char* help) {
    command->add_option(name, value, help)->check(refuse_not_positive)->type_name(type);
  };
  add("--mass-kg", load.mass_kg, "KG",
      "Mass that a screw or a belt moves; with --lead-mm or --belt-mm");
  add("--lead-mm", load.lead_mm, "MM", "Lead of the screw: travel of the mass in one turn of it");
  add("--belt-mm", load.belt_mm, "MM",
      "Travel of the belt in one turn of its pulley: teeth times their pitch");
  add_quantity(
      command, "--load-inertia", Quantity::kInertia,
      [&load](double value) { load.inertia_kgm2 = value; },
      "Inertia of a load that turns, such as a rotary table, at its own axis");
  add("--gear", load.gear, "RATIO",
      "Turns of the motor for one turn of screw, pulley or turning load (default 1)");
}

}  // namespace

void add_motor_options(CLI::App* command, MotorOptions& options) {
  command
      ->add_option(
          "--torque", options.torque_file,
          "CSV of pull-out torque against speed: header speed_hz|speed_rpm,"
          "torque_nm|torque_ncm|torque_mnm; speed_hz counts microsteps, as all speeds here")
      ->type_name("FILE");
  profiles::Motor& motor = options.motor;
  add_quantity(
      command, "--inertia", Quantity::kInertia, [&](double value) { motor.inertia_kgm2 = value; },
      "Inertia of the rotor, and of the load as far as no other option states it");
  add_load_options(command, options.load);
  add_quantity(
      command, "--friction", Quantity::kTorque, [&](double value) { motor.friction_nm = value; },
      "Torque of friction and load against the motion (default 0)");
  add_quantity(
      command, "--brake-friction", Quantity::kTorque,
      [&](double value) { motor.brake_friction_nm = value; },
      "Part of the friction that surely helps braking (default 0)");
  command
      ->add_option("--safety", motor.safety,
                   "Safety factor: torque of the motor / torque used (default 2)")
      ->type_name("FACTOR");
  command
      ->add_option("--steps-per-turn", motor.steps_per_turn,
                   "Steps of a turn, microsteps included (default 200)")
      ->check(refuse_not_positive)
      ->type_name("N");
  command
      ->add_option(
          "--full-steps-per-turn", motor.full_steps_per_turn,
          "Full steps of a turn, for the jumps of speed that the rotor can follow (default 200)")
      ->check(refuse_not_positive)
      ->type_name("N");
}

void add_new_options(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<New>();
  CLI::App* command = app.add_subcommand("new", "Make a table from an acceleration profile");
  command->add_option("TABLE", options->table, "The new table's name, or a file NAME.toml")
      ->required();
  profiles::Spec& spec = options->spec;
  add_side_options(command, "", [&spec]() -> profiles::SideSpec& { return spec.accel; });
  add_speed_options(command, spec);
  // What is not said of the decelerating side is as on the other; how steep it is counts as one.
  const auto decel = std::make_shared<std::optional<profiles::SideSpec>>();
  add_side_options(command, "decel-", [decel]() -> profiles::SideSpec& {
    if (!*decel) decel->emplace();
    return **decel;
  });
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
  run(command, [&places, options, decel, command] {
    if (*decel) {
      profiles::SideSpec side = **decel;
      const profiles::SideSpec& accel = options->spec.accel;
      if (command->count("--decel-law") == 0) side.profile = accel.profile;
      if (command->count("--decel-fall") == 0) side.fall = accel.fall;
      if (!side.acceleration && !side.time_s && !side.codes && side.profile == accel.profile) {
        side.acceleration = accel.acceleration;
        side.time_s = accel.time_s;
        side.codes = accel.codes;
      }
      options->spec.decel = side;
    }
    return make_new(places, *options);
  });
}

void add_wizard_options(CLI::App& app, const Places& places, const Run& run) {
  const auto options = std::make_shared<Wizard>();
  CLI::App* command = app.add_subcommand(
      "wizard", "Ask for a profile as PLC wizards do, draw it, and make a table of it");
  command->add_option("TABLE", options->table, "The new table's name, or a file NAME.toml")
      ->required();
  command->add_flag("--replace", options->replace, "Make a new revision if the table exists");
  run(command, [&places, options] { return wizard(places, *options); });
}

}  // namespace bushtab
