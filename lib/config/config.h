// bushd.toml (docs/configuration.md): which motor is connected to which output of which MCU on
// which bus, and which table it runs. A Config that exists is consistent: every index below is
// valid, every bus has an MCU, no output is used twice, every table is slow enough for its bus's
// tick and no line is asked for more than it can carry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/converter.h"
#include "base/ids.h"
#include "base/result.h"
#include "base/units/coordinates.h"
#include "bus/emission_setup.h"
#include "config/drive.h"
#include "config/key_places.h"
#include "config/setting.h"
#include "engine/message.h"
#include "motion/pseudo/curved_axis.h"
#include "motion/pseudo/linear_axes.h"
#include "tables/table.h"

namespace bushd::config {

struct Lcm {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string prefix = "BUSHD";
  bool commands = true;  // false: LCM only publishes
};

// The control socket.
struct Control {
  // Empty: none. Without a value: where the daemon may make one (control/path.h).
  std::optional<std::string> path = {};
  std::string group = {};  // that may use it; empty: that of the daemon
  Error group_at{};        // without a message
};

// What is kept over power cuts.
struct State {
  // A folder. Without a value: $STATE_DIRECTORY, or /var/lib/bushd where that is there.
  std::optional<std::string> path = {};
  bool required = true;  // nothing moves that could not be found uncertain afterwards
};

// One of the numbered inputs of an MCU; all that is connected to it has one level.
struct Input {
  std::uint8_t number = 0;
  bool active_open = false;
  friend bool operator==(const Input&, const Input&) = default;
};

// Inputs of its MCU. One input may be several of these, but for the step sensor's.
struct MotorInputs {
  std::optional<Input> positive = {};  // limit switches; the same input: one for both ends
  std::optional<Input> negative = {};
  std::optional<Input> home = {};  // looked for as Motor::home says
  std::optional<Input> step = {};  // a sensor that tells its steps
  // That with the number of its output, the one that a motor without the key `inputs` has.
  std::optional<Input> own = {};
};

enum class BusKind { kRs485, kSerialPulse, kCommutator };  // docs/decisions/0043-bus-kinds.md

// The settings of a bus of kind serial-pulse.
struct SerialPulse {
  bool rts = false;           // the direction is on RTS, else on DTR
  bool positive_off = false;  // that line is off in the positive direction
  MotorInputs inputs = {};    // inputs 0..3 are the modem lines CD, DSR, CTS, RI
};

// What becomes of motions whose streams would be more than the line of a bus can carry.
enum class Streams {
  kFit,     // there are none: the configuration is refused unless all motors can stream at once
  kRefuse,  // they are refused
  kQueue    // they begin as soon as there is room for them
};

struct Bus {
  std::string name;
  BusKind kind = BusKind::kRs485;
  std::string port;        // as written in the file; may be a pattern (config/port_pattern.h)
  std::uint32_t baud = 0;  // one of libserial's fixed rates; 0: of a kind without
  std::uint32_t tick_us = 2560;
  bushd_format format = BUSHD_FORMAT_FINE;
  bool table_runs = false;  // a move from rest is given to the MCU as a whole, if the MCU can
  bool table_ticks = true;  // streamed ticks may be told as states of the run
  Streams streams = Streams::kFit;
  bushd_stop_mode emergency_stop = BUSHD_STOP_RAMP;
  SerialPulse serial_pulse = {};
  // The settings of a commutator board.
  std::uint32_t start_hz = 0;            // F_start; 0: it has a converter
  std::optional<Converter> converter{};  // by whose pulses it steps
  std::uint32_t answer_ms = 0;           // for an answer, beyond twice its delay

  KeyPlaces places{};  // of `port`, `format`, `tick_us`, `emergency_stop`

  std::uint32_t tick_ns() const { return tick_us * 1000u; }
};

enum class EnableAfterReset {
  kReady,   // drivers are on again as soon as the MCU is configured
  kAtOnce,  // after a watchdog reset the MCU itself raises EN
  kNo       // after a watchdog reset they stay off until somebody enables them
};

struct Mcu {
  BusId bus;
  McuAddress address;
  std::string id;  // "hall:1"
  fieldbus::EmissionSetup emission{};
  bushd_set_outputs outputs{.step_low = 0, .direction_low = 0, .enabled = BUSHD_ENABLED_HIGH};
  Error outputs_at{};  // the last key that says that one of them is active low; without a message
  std::uint8_t emergency_input = BUSHD_EMERGENCY_INPUT_IGNORED;
  bool emergency_active_open = false;
  std::uint8_t debounce_ticks = 1;
  std::uint16_t overcurrent = 0;  // reading of the current sensor; 0: no threshold
  EnableAfterReset enable_after_reset = EnableAfterReset::kReady;
  std::optional<double> idle_disable_s =
      {};                              // drivers are disabled after so long a rest; 0: at once
  std::uint32_t enable_settle_ms = 0;  // from enabling them to the first step
  std::uint32_t keypad_ms = 500;       // that a key of its keypad counts; 0: until the next one
  bool programs_without_host = false;  // its programs may go on when no host is heard
  bool programs_at_power_on = false;   // and begin by themselves when the power comes
  bool ready_after_homing = false;     // not before its motors with `home` have been homed
  bool has_phase_sequence = false;     // written in the file
  bool stand_in = false;               // for a bus that has no MCUs
  KeyPlaces places{};                  // of `address`, `ready`, `emergency_input`
};

struct Group {
  std::string name;
  std::string table_name;  // as written in the file, without ".toml"
  tables::TablePtr table;  // never null; groups with the same table share it
};

// Where a motor's switch is, and how it is looked for.
struct Home {
  bool positive = false;            // the direction towards the switch
  std::int32_t position_steps = 0;  // at the switch
  std::uint32_t most_steps = 0;     // to it
  std::uint32_t slow_steps_per_s = 100;
  std::optional<std::uint32_t> slow_most_steps = {};
  bool at_start = false;             // whenever its MCU comes and has not homed it
  std::int32_t order = 1;            // of all that are homed together: the lower ones first
  std::optional<double> speed = {};  // of the fast approach unless asked otherwise, user units/s
  std::optional<double> then = {};   // user position to move to once the switch was found
};

struct Motor {
  std::string name;
  McuId mcu;
  Output output;
  GroupId group;
  MotorInputs inputs = {};
  bushd_stop_mode limit_action = BUSHD_STOP_RAMP;
  std::optional<Home> home = {};
  bool restored_refused = false;  // it may not move while its position is only restored
  std::string description{};
  units::Coordinates coordinates{};
  std::optional<units::SoftLimits> soft_limits = {};
  std::optional<double> max_speed = {};       // user units/s, above 0
  double backlash = 0;                        // user units; its sign is that of the last approach
  std::optional<double> backlash_speed = {};  // of that, user units/s, above 0
  std::int64_t settle_ms = 0;                 // from the last step to the result
  Drive drive{};
  bool has_one_input = false;  // that with the number of its output, which no other motor names
  bool never_disable = false;  // its MCU's drivers stay enabled at rest
  WrittenKeys written{};       // which settings the file has, also where it has a default
  KeyPlaces places{};          // of `output`, `group`, `inputs`, `currents`, `velocity`, `keypad`
};

// A box with keys on a serial line of its own, which jogs a motor.
struct Keypad {
  std::string port{};
  std::uint32_t baud = 625;
  MotorId motor{};
  bool latched = false;  // a key counts until the next one; else as long as its byte is repeated
  std::uint32_t delay_us = 3'000;     // of a step, at first
  std::uint32_t slower_us = 300;      // more with each key "slower"
  std::uint32_t slowest_us = 30'000;  // beyond it, the first one again
  std::uint32_t keepalive_ms = 500;   // 50..10000
  Error port_at{};                    // without a message
};

struct PseudoAxis {
  std::string name{};
  std::string unit{};
  std::optional<units::SoftLimits> soft_limits = {};  // of its own, beside those of its motors
  int decimals = 4;                                   // that people are shown
};

using PseudoLaw = std::variant<pseudo::LinearAxes, pseudo::CurvedAxis>;

// Axes that are computed from motors, all of one bus.
struct Pseudo {
  std::vector<PseudoAxis> axes{};
  std::vector<MotorId> motors{};  // in the order of the law's
  PseudoLaw law{};
};

// A module of a CAMAC crate (docs/camac.md).
struct CamacModule {
  enum class Type { kBushd1, kBushd2 };
  // What the adjustable delay after a reactor start is of.
  enum class AdjustableDelay { kReturn, kOpening };
  int station = 0;
  Type type = Type::kBushd2;
  int f_start_hz = 40;                                          // of kBushd2: code 250
  AdjustableDelay adjustable_delay = AdjustableDelay::kReturn;  // of kBushd1
  bool without_computer = false;  // its motions go on when no daemon is heard
  std::vector<MotorId> motors{};  // by their numbers in the module; kBushd1 has one
};
struct Crate {
  int number = 1;
  std::vector<CamacModule> modules{};
};

struct Config {
  std::string path;
  // Where that is, and what its text was when it was read.
  std::string absolute_path;
  std::string text_sha256;
  Lcm lcm;
  Control control;
  State state;
  // In the order of the file.
  std::vector<Bus> buses;
  std::vector<Mcu> mcus;
  std::vector<Group> groups;
  std::vector<Motor> motors;
  std::vector<Crate> crates;
  std::vector<Pseudo> pseudos{};
  std::vector<Keypad> keypads{};

  // States are published by MCU, and then by section of computed axes.
  std::size_t state_parts() const { return mcus.size() + pseudos.size(); }

  const Bus& operator[](BusId id) const { return buses[id.value]; }
  const Mcu& operator[](McuId id) const { return mcus[id.value]; }
  const Group& operator[](GroupId id) const { return groups[id.value]; }
  const Motor& operator[](MotorId id) const { return motors[id.value]; }

  const Bus& bus_of(const Mcu& mcu) const { return (*this)[mcu.bus]; }
  const Mcu& mcu_of(const Motor& motor) const { return (*this)[motor.mcu]; }
  const Group& group_of(const Motor& motor) const { return (*this)[motor.group]; }
  const Bus& bus_of(const Motor& motor) const { return bus_of(mcu_of(motor)); }
  const tables::Table& table_of(const Motor& motor) const { return *group_of(motor).table; }
};

// Reads the file and the tables it names; the first thing that is wrong is the error.
Result<Config> load(const std::filesystem::path& path);

// The same for the text of a file that would be at `path`: tables are looked for beside it.
Result<Config> parse(std::string_view text, const std::filesystem::path& path);

// Where the tables of the configuration at this path are looked for, in this order.
std::vector<std::filesystem::path> table_directories(const std::filesystem::path& path);

}  // namespace bushd::config
