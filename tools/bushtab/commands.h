// What bushtab does. Every command returns the exit code: 0 done, 1 refused (the reason is on
// stderr).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/converter.h"
#include "curve.h"
#include "engine/message.h"
#include "open_table.h"
#include "tables/profiles/diagnostics.h"
#include "tables/profiles/make.h"
#include "tables/speed_zones.h"

namespace bushtab {

inline constexpr int kDone = 0;
inline constexpr int kRefused = 1;

// What the motor moves, if it is told apart from the inertia of the rotor.
struct LoadOptions {
  std::optional<double> mass_kg;
  std::optional<double> lead_mm;  // one of these two with a mass
  std::optional<double> belt_mm;
  std::optional<double> inertia_kgm2;
  std::optional<double> gear;
};
// Refused: a mass without its way, a way or a gear without a load.
bushd::Result<bushd::tables::profiles::Load> load_of(const LoadOptions& options);

// What is known of the motor, for profiles and checks that ask for it.
struct MotorOptions {
  std::string torque_file;               // empty: nothing is known
  bushd::tables::profiles::Motor motor;  // inertia: without that of `load`
  LoadOptions load;
};
bushd::Result<std::optional<bushd::tables::profiles::Motor>> load_motor(
    const MotorOptions& options);

// The table that a command is about, and whether it tells in JSON what it did.
struct TableOptions {
  std::string table;
  bool json = false;
};

struct Show : TableOptions {
  bool steps = false;                           // every step of the move that just comes to cruise
  std::optional<bushd::Converter> converter{};  // with its codes K of these steps
};
int show(const Places& places, const Show& wanted);
// What a command that wrote a table says: its revision; with `json`, what show says of it.
int saved(const Home& home, const bushd::Result<std::uint32_t>& revision, bool json);

// What a table is checked against; `limits.motor` is that of `motor`.
struct LimitOptions {
  bushd::tables::profiles::Limits limits;
  MotorOptions motor;
};
bushd::Result<bushd::tables::profiles::Limits> load_limits(const LimitOptions& options);

struct Check {
  std::vector<std::string> tables;
  LimitOptions limits;
  bool strict = false;  // warnings are refusals too
  bool json = false;
};
int check(const Places& places, const Check& wanted);

struct Expansion : TableOptions {
  std::int64_t steps = 0;  // -INT32_MAX .. INT32_MAX
  std::uint32_t tick_us = 0;
  bushd_format format = BUSHD_FORMAT_FINE;
  std::optional<double> speed;  // steps/s, not to be exceeded
};
int expand(const Places& places, const Expansion& expansion);

// The table of a spec whose name is a table as on the command line.
struct New : TableOptions {
  bushd::tables::profiles::Spec spec;
  MotorOptions motor;
  std::vector<std::string> comments;
  bool print = false;    // to stdout instead of into a file
  bool replace = false;  // a table that is there: a new revision of it
};
int make_new(const Places& places, const New& wanted);

// Asks on standard output for what PLC wizards ask, draws the profile, writes the table. Answers
// come from standard input, a line each: typed, or ready in a file.
struct Wizard {
  std::string table;
  bool replace = false;
};
int wizard(const Places& places, const Wizard& wanted);

// A change of a table that is there: a new revision, comments kept.
using Change =
    std::function<bushd::Result<bushd::tables::TableContent>(bushd::tables::TableContent content)>;
int change(const Places& places, const TableOptions& options, const std::string& note,
           const Change& change);
// Says on stderr which texts of the table were kept and never saved, if any were.
void tell_kept(const std::filesystem::path& table, const std::string& name);
// In $VISUAL or $EDITOR; what is no table is kept aside, and the old one stays.
int edit(const Places& places, const TableOptions& options);
// In the terminal; refused if there is none.
struct Tui {
  std::string table;
  LimitOptions limits;
  std::vector<std::uint32_t> steps;  // of moves whose times are shown
};
int tui(const Places& places, const Tui& wanted);
struct Copy : TableOptions {
  std::string to;
};
int copy(const Places& places, const Copy& wanted);
int log(const Places& places, const TableOptions& options);
struct Revert : TableOptions {
  std::string revision;
};
int revert(const Places& places, const Revert& wanted);
struct Tag : TableOptions {
  std::string tag;
  std::string revision;
};
int tag(const Places& places, const Tag& wanted);

struct BushdExport : TableOptions {
  std::string image;
  unsigned page = 0;
  std::uint32_t steps = 0;
  std::string positions;  // hexadecimal; empty: those of the image
  bool resample = false;
  bool bushd1 = false;
  std::uint32_t reactor_delay = 0;
};
int export_bushd(const Places& places, const BushdExport& wanted);

struct BushdImport : TableOptions {
  std::string image;
  unsigned page = 0;
  std::optional<double> start_hz;             // needed but for bushd1
  std::optional<std::uint32_t> time_unit_ns;  // needed for bushd1
  bool bushd1 = false;
  bool replace = false;
};
int import_bushd(const Places& places, const BushdImport& wanted);

int list(const Places& places, bool json);
// In the terminal: as wide as that is, coloured if it is one.
int plot(const Places& places, const std::vector<std::string>& tables);
// Precondition: as many names as tables.
void draw_in_terminal(const std::vector<bushd::tables::TablePtr>& tables,
                      const std::vector<std::string>& names);
// Under a title that says what is drawn; over the steps of the move, or over time.
enum class Over { kSteps, kTime };
void draw_in_terminal(const std::string& title, const std::vector<Curve>& curves, Over over);
struct Plot {
  std::vector<std::string> tables;
  std::string svg;  // files; empty: none
  std::string png;
};
int draw_pictures(const Places& places, const Plot& wanted);
// `heading` stands above the legends.
bushd::Result<void> write_pictures(const std::string& heading, const std::vector<Curve>& curves,
                                   const std::string& svg, const std::string& png);

// An envelope: its figures and its drawing. With changes it is written before.
struct Envelope {
  std::string name;  // or a path
  std::optional<std::string> table{};
  std::optional<std::string> by{};
  std::optional<double> steps_per_unit{};
  std::vector<bushd::tables::SpeedZones::Zone> zones{};  // none: those of the file
  std::optional<double> end{};
  std::optional<std::string> description{};
  bool replace = false;  // what is given, in an envelope that is there
  bool json = false;
  std::string svg{};  // files; empty: none
  std::string png{};
};
int envelope(const Places& places, const Envelope& wanted);
struct Times : TableOptions {
  std::vector<std::uint32_t> steps;
};
int time(const Places& places, const Times& wanted);
struct Diff {
  std::string before;
  std::string after;
  bool json = false;
};
int diff(const Places& places, const Diff& wanted);

}  // namespace bushtab
