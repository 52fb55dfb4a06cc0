// The command line of each group of commands. CLI11 is slow to compile: only these files include
// it. An Action is what the program does when its command was given.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "commands.h"
#include "tables/profiles/quantity.h"

namespace bushtab {

// Gives the command its action; the result is the program's exit code.
using Run = std::function<void(CLI::App* command, std::function<int()> action)>;

inline constexpr const char* kTable = "A table's file or name";

void add_look_options(CLI::App& app, const Places& places, const Run& run);
void add_edit_options(CLI::App& app, const Places& places, const Run& run);
void add_new_options(CLI::App& app, const Places& places, const Run& run);
void add_envelope_options(CLI::App& app, const Places& places, const Run& run);
void add_wizard_options(CLI::App& app, const Places& places, const Run& run);

void add_motor_options(CLI::App* command, MotorOptions& motor);

void add_limit_options(CLI::App* command, LimitOptions& limits);

// An option whose value has a unit.
CLI::Option* add_quantity(CLI::App* command, const std::string& name,
                          bushd::tables::profiles::Quantity quantity,
                          std::function<void(double)> set, const std::string& help);

// A check that tells the range, which CLI11's own does not if the type of the number ends before
// ("Could not convert"), and calls "5.5" no whole number. `remedy` follows the range after "as".
std::function<std::string(const std::string&)> whole_number(std::int64_t least,
                                                            std::int64_t greatest,
                                                            const std::string& remedy = {});

// CLI11's own check tells the range of a double in 300 digits.
std::string refuse_not_positive(const std::string& value);

}  // namespace bushtab
