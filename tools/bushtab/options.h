// The command line of each group of commands. CLI11 is slow to compile: only these files include
// it.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "commands.h"
#include "tables/profiles/quantity.h"

namespace bushtab {

inline constexpr const char* kTable = "A table's file or name";

class Commands {
 public:
  // `chosen` becomes what the program does when it was given a command; the result is its exit
  // code.
  Commands(CLI::App& app, const Places& places, std::function<int()>& chosen)
      : app_(app), places_(places), chosen_(chosen) {}

  // A command that does action(places, options), and these options, to be filled.
  template <class Options, class Action>
  std::pair<CLI::App*, Options*> add(const std::string& name, const std::string& help,
                                     Action action) {
    CLI::App* command = app_.add_subcommand(name, help);
    const auto options = std::make_shared<Options>();
    command->final_callback([this, options, action] {
      chosen_ = [this, options, action] { return action(places_, *options); };
    });
    return {command, options.get()};
  }

 private:
  CLI::App& app_;
  const Places& places_;
  std::function<int()>& chosen_;
};

void add_look_options(Commands& commands);
void add_edit_options(Commands& commands);
void add_new_options(Commands& commands);
void add_envelope_options(Commands& commands);
void add_wizard_options(Commands& commands);

void add_motor_options(CLI::App* command, MotorOptions& motor);

void add_limit_options(CLI::App* command, LimitOptions& limits);

// The table that a command is about, and how it tells what it did.
void add_table_options(CLI::App* command, TableOptions& options,
                       const std::string& json_help = "Print JSON");
void add_new_table(CLI::App* command, const std::string& name, std::string& table);
void add_picture_options(CLI::App* command, std::string& svg, std::string& png);

// An option that has a value, which --help calls `type`.
template <class Value>
CLI::Option* add_value(CLI::App* command, const std::string& name, Value& value,
                       const std::string& type, const std::string& help) {
  return command->add_option(name, value, help)->type_name(type);
}

// An option whose value has a unit.
CLI::Option* add_quantity(CLI::App* command, const std::string& name,
                          bushd::tables::profiles::Quantity quantity,
                          std::function<void(double)> set, const std::string& help);
template <class Value>
CLI::Option* add_quantity(CLI::App* command, const std::string& name,
                          bushd::tables::profiles::Quantity quantity, Value& value,
                          const std::string& help) {
  return add_quantity(command, name, quantity, [&value](double number) { value = number; }, help);
}
void add_time_unit(CLI::App* command, std::optional<std::uint32_t>& ns, const std::string& help);

// A check that tells the range, which CLI11's own does not if the type of the number ends before
// ("Could not convert"), and calls "5.5" no whole number. `remedy` follows the range after "as".
std::function<std::string(const std::string&)> whole_number(std::int64_t least,
                                                            std::int64_t greatest,
                                                            const std::string& remedy = {});

// CLI11's own check tells the range of a double in 300 digits.
std::string refuse_not_positive(const std::string& value);

}  // namespace bushtab
