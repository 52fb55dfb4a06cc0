// The keys of a motor that may be changed in operation, and their values as texts: as clients and
// the state store have them, and as bushd.toml does but for quotes.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/units/coordinates.h"
#include "config/drive.h"

namespace bushd::config {

// In the order in which they may be taken: a velocity is of a motor that people move. What goes
// before all others is said by goes_first(). All that is said about a key stands in its row of
// setting.cpp.
enum class SettingKey {
  kOffset,
  kDirection,
  kSoftLimits,
  kInputActive,
  kLocal,
  kKeypad,
  kVelocity,
  kCurrents,
  kMaxSpeed,
  kAcceleration,
  kPhaseSequence,
  kCount
};
inline constexpr auto kSettingKeys = [] {
  std::array<SettingKey, static_cast<std::size_t>(SettingKey::kCount)> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<SettingKey>(i);
  return all;
}();

// By SettingKey.
using WrittenKeys = std::bitset<kSettingKeys.size()>;

std::string_view name_of(SettingKey key);  // as in bushd.toml
std::string help_of(SettingKey key);       // "offset=12.5": for the help of commands
bool is_word(SettingKey key);              // bushd.toml has its value in quotes
// A motor that has no max_speed any more may be moved by people, and one that they do not move any
// more may have one. `value` is one that text_of() makes.
bool goes_first(SettingKey key, std::string_view value);
std::optional<SettingKey> setting_key_of(std::string_view name);
// It is a key of the motor's MCU, and of all motors there.
inline bool is_of_mcu(SettingKey key) {
  return key == SettingKey::kPhaseSequence;
}

// What the settings of one motor stand for.
struct Settings {
  units::Coordinates coordinates{};
  std::optional<units::SoftLimits> soft_limits = {};
  Drive drive{};
  bool phases = false;   // its MCU drives it by phases: it may have currents
  bool has_mcu = false;  // its controller is an MCU, which can move it by local inputs
  std::optional<double> max_speed = {};  // user units/s; an MCU does not keep to it by itself
  // Its drivers are disabled at rest, and local inputs cannot enable them.
  bool idle_disabled = false;
  // It has one input, which no other motor uses: input_active may be changed.
  bool has_one_input = false;
  WrittenKeys written{};  // what was left out has its default
};
struct Motor;
struct Mcu;
Settings settings_of(const Motor& motor, const Mcu& mcu);  // as bushd.toml has them

// Whether the motor has this setting. Offset, direction and soft limits need a unit, velocity needs
// local inputs or a keypad, currents and phase_sequence need a motor that is driven by phases.
bool applies(const Settings& settings, SettingKey key);
// Whether it is listed when all settings are asked for. The defaults of `local`, `keypad`,
// `input_active`, `max_speed` and `acceleration` are not.
bool is_reported(const Settings& settings, SettingKey key);

// "12.5"; "negative"; "[-5, 30]" or "none"; "true" or "false"; velocity and currents as an inline
// table of TOML, or "none"; max_speed "2.5" or "none"; acceleration "0.5"; phase_sequence "half".
// The same value has one text.
std::string text_of(const Settings& settings, SettingKey key);

// "offset = 12.5"; "" if it was left out.
std::string line_of(const Settings& settings, SettingKey key);

// With another value, written. Beside the texts above, soft limits may come without brackets and
// blanks:
// "-5,30", and inline tables without names, in their order: "100,1500,500" and
// "1500,1000,300,fast". Errors name key, value, cause and what is allowed, not the motor.
Result<Settings> with(Settings settings, SettingKey key, std::string_view text);

// Error: no step lies between them.
Result<void> check_soft_limits(const units::Coordinates& coordinates,
                               const units::SoftLimits& limits);

// Error: no share of a table's acceleration: above 0 and at most 1. Without key.
Result<void> check_acceleration_share(double share);
// Error: no speed above 0, or slower than a step an hour. Without key; in user units/s.
Result<void> check_user_speed(const units::Coordinates& coordinates, double speed);

}  // namespace bushd::config
