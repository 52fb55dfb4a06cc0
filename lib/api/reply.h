// What is said to a request: Refused and nothing more, or Accepted and later exactly one Completed;
// Completed alone where a request is over with its answer (one that a stop has ended before it was
// carried out, and a stop that could not stop all).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/table_file.h"
#include "api/words.h"
#include "base/fields.h"
#include "base/units/coordinates.h"
#include "words/camac.h"

namespace bushd::api {

// Which table it is, in short.
struct TableRef {
  std::string name{};
  std::uint32_t revision = 0;  // counted by bushtab from 1; 0: the table's file tells none
  std::string hash{};          // first kHashLength digits of the SHA-256 of what moves a motor
  static constexpr std::size_t kHashLength = 8;
  static void fields(auto& self, auto& visit) {
    visit("name", self.name);
    visit("revision", self.revision, fields::OrZero<std::int32_t>{INT32_MAX});
    visit("hash", self.hash);
  }
  friend bool operator==(const TableRef&, const TableRef&) = default;
};

// A number of decimals.
struct Decimals {
  static std::int8_t told(int decimals) { return static_cast<std::int8_t>(decimals); }
  static bool taken(std::int8_t told, int& decimals) {
    decimals = std::clamp<int>(told, 0, units::Coordinates::kMostDecimals);
    return true;
  }
};

// What became of one motor of a move.
struct MotorResult {
  std::string motor{};
  Outcome outcome = Outcome::kFault;
  std::int64_t position_steps = 0;  // where its MCU says that it stands
  double user = 0;                  // the same for people (units/coordinates.h)
  double dial = 0;
  std::string unit = "steps";
  int precision = 0;            // decimals of both
  TableRef table{};             // by which it has moved
  std::string who{};            // asked for it
  int legs = 1;                 // how many its motion had, as planned
  double most_steps_per_s = 0;  // not exceeded by any of them; 0 of what the MCU makes by itself

  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit("outcome", self.outcome, fields::Word{outcome_of});
    visit("position_steps", self.position_steps);
    visit("user_position", self.user);
    visit("dial_position", self.dial);
    visit("unit", self.unit);
    visit("precision", self.precision, Decimals{});
    visit("table", self.table);
    visit("asked_by", self.who);
    visit("legs", self.legs, fields::As<std::int8_t>{});
    visit("most_steps_per_s", self.most_steps_per_s);
  }
};

// What a move would be.
struct MovePlan {
  struct Motor {
    std::string motor{};
    std::int64_t steps = 0;
    std::int64_t duration_us = 0;  // to its last step
    double peak_steps_per_s = 0;
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit("steps", self.steps);
      visit("duration_us", self.duration_us);
      visit("peak_steps_per_s", self.peak_steps_per_s);
    }
  };
  // Frames of the motion alone: no polls, synchronisation and repeats.
  struct Traffic {
    std::int64_t frames = 0;
    std::int64_t bytes = 0;  // on the bus
  };
  std::int64_t duration_us = 0;  // from the first tick to the end of the last one
  std::int64_t ticks = 0;
  std::optional<Traffic> traffic{};  // none: it is too much to be counted
  std::string limited_by{};          // of a line: the motor that makes it take so long
  std::vector<Motor> motors{};       // in the request's order, each leg of a motor by itself
  // When each point of a path of at most kMostPoints is reached, from the first tick on.
  std::vector<std::int64_t> points_us{};
  static constexpr std::size_t kMostPoints = 2048;
  static void fields(auto& self, auto& visit) {
    Traffic traffic = self.traffic.value_or(Traffic{.frames = -1, .bytes = -1});
    visit("duration_us", self.duration_us);
    visit("ticks", self.ticks);
    const fields::If counted{self.traffic.has_value()};
    visit("frames", traffic.frames, counted);
    visit("bytes", traffic.bytes, counted);
    visit("limited_by", self.limited_by, fields::If{!self.limited_by.empty()});
    visit.list("motor_count", "motors", self.motors);
    visit.list("point_count", "points_us", self.points_us);
    visit.set(self.traffic, traffic.frames < 0 ? std::optional<Traffic>{} : traffic);
  }
};

// One of the tables that the daemon finds.
struct TableEntry {
  std::string name{};   // its file's name without ".toml"
  std::string fault{};  // why it cannot be used; "": it can, and the rest means something
  TableRef table{};
  std::int32_t codes = 0;  // of both sides, of one if they mirror each other
  double start_steps_per_s = 0;
  double max_steps_per_s = 0;
  static void fields(auto& self, auto& visit) {
    visit("name", self.name);
    const fields::If good{self.fault.empty()};
    visit("table", self.table, good);
    visit("fault", self.fault);
    visit("codes", self.codes, good);
    visit("start_steps_per_s", self.start_steps_per_s, good);
    visit("max_steps_per_s", self.max_steps_per_s, good);
  }
};
struct TableList {
  std::vector<TableEntry> entries{};
};

// What has moved a motor, or made its position known.
struct PastMotion {
  std::int64_t utime_us = 0;  // when it ended
  std::string what{};         // move, home, arm, jog, set, config, confirm
  std::string who{};
  std::int64_t from_steps = 0;
  std::int64_t to_steps = 0;
  std::string outcome{};
  std::string reason{};
  // As they were shown to people then.
  std::string from_text{};
  std::string to_text{};
  static void fields(auto& self, auto& visit) {
    visit("utime_us", self.utime_us);
    visit("what", self.what);
    visit("who", self.who);
    visit("from_steps", self.from_steps);
    visit("to_steps", self.to_steps);
    visit("outcome", self.outcome);
    visit("reason", self.reason);
    visit("from_text", self.from_text);
    visit("to_text", self.to_text);
  }
  friend bool operator==(const PastMotion&, const PastMotion&) = default;
};
struct MotionHistory {
  std::vector<PastMotion> motions{};
  static void fields(auto& self, auto& visit) {
    visit.list("motion_count", "motions", self.motions);
  }
};

// What may be changed in operation, and what bushd.toml says of it.
struct MotorSetting {
  std::string motor{};
  std::string key{};
  std::string value{};
  std::string in_file{};
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit("key", self.key);
    visit("value", self.value);
    visit("value_in_file", self.in_file);
  }
  friend bool operator==(const MotorSetting&, const MotorSetting&) = default;
};
struct Configuration {
  std::string path{};    // of bushd.toml, absolute, on the daemon's PC
  std::string sha256{};  // of its text as the daemon knows it
  std::vector<MotorSetting> settings{};
  static void fields(auto& self, auto& visit) {
    visit("path", self.path);
    visit("sha256", self.sha256);
    visit.list("setting_count", "settings", self.settings);
  }
};

// What a crate has answered.
struct CamacResult {
  camac::BlockResult block{};
  std::uint32_t requests = 0;  // L lines of its stations afterwards; bit n - 1 is station n
  static void fields(auto& self, auto& visit) {
    visit("tally", self.block.tally);
    visit("requests", self.requests);
    visit.list("response_count", "responses", self.block.responses);
  }
  friend bool operator==(const CamacResult&, const CamacResult&) = default;
};

// The program of an MCU.
struct ProgramEntry {
  // What it does to a motor, by a walk through its frames from where the motor stands; of a repeat
  // without end one pass. Of a program that the daemon does not know only the name.
  struct Motor {
    std::string motor{};
    std::int64_t least_steps = 0;  // where it comes to, its beginning included
    std::int64_t most_steps = 0;
    std::int64_t end_steps = 0;
    std::int64_t edges = 0;  // steps that it makes
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit("least_steps", self.least_steps);
      visit("most_steps", self.most_steps);
      visit("end_steps", self.end_steps);
      visit("edges", self.edges);
    }
    friend bool operator==(const Motor&, const Motor&) = default;
  };
  std::string mcu{};
  std::string program{};   // its name; "": none, or one that the daemon does not know
  std::string checksum{};  // CRC-32 of its bytes, 8 hexadecimal digits; "": the MCU has none
  std::string stage{};   // none, loading, loaded, waits, runs, pauses, paused, ends, ended, unknown
  std::string reason{};  // why its last run has ended, in words; "": it has not
  bool without_host = false;
  bool at_power_on = false;  // it begins by itself when the power comes
  bool kept = false;         // it is to outlive power cuts
  bool stored = false;       // and would now
  std::int32_t bytes = 0;    // of it, or of what has arrived of it
  std::int32_t memory = 0;   // bytes that one may have
  std::int32_t frame = 0;    // that is carried out, or was last, from 1; 0: none yet
  std::int32_t point = 0;    // of it, if it is a line, from 1
  std::int64_t repeats = 0;
  // The walk; of a program that the daemon knows.
  std::int64_t duration_us = 0;  // without the time in which it waits for inputs
  std::int64_t pulses = 0;
  bool endless = false;  // it repeats without end: the rest is of one pass
  bool waits_for_inputs = false;
  bool cut = false;  // there are more frames to carry out than a walk has
  std::vector<Motor> motors{};
  static void fields(auto& self, auto& visit) {
    visit("mcu", self.mcu);
    visit("program", self.program);
    visit("checksum", self.checksum);
    visit("stage", self.stage);
    visit("reason", self.reason);
    visit("without_host", self.without_host);
    visit("at_power_on", self.at_power_on);
    visit("kept", self.kept);
    visit("stored", self.stored);
    visit("bytes", self.bytes);
    visit("memory", self.memory);
    visit("frame", self.frame);
    visit("point", self.point);
    visit("repeats", self.repeats);
    visit("duration_us", self.duration_us);
    visit("pulses", self.pulses);
    visit("endless", self.endless);
    visit("waits_for_inputs", self.waits_for_inputs);
    visit("cut", self.cut);
    visit.list("motor_count", "motors", self.motors);
  }
  friend bool operator==(const ProgramEntry&, const ProgramEntry&) = default;
};
struct ProgramList {
  std::vector<ProgramEntry> programs{};
  static void fields(auto& self, auto& visit) {
    visit.list("program_count", "programs", self.programs);
  }
  friend bool operator==(const ProgramList&, const ProgramList&) = default;
};

struct Accepted {};

struct Refused {
  std::string reason{};  // what, why with the figure, what to do
};

// Motors of moves, homing and arming, in the request's order; a plan of a dry run; answers of the
// table requests; a history; settings; of a crate; programs. (Its copies are compiled once, not in
// every file that has one. So are those of Reply and Request.)
struct Detail : std::variant<std::monostate, std::vector<MotorResult>, MovePlan, TableList,
                             TableFile, MotionHistory, Configuration, CamacResult, ProgramList> {
  using variant::variant;
  Detail();
  Detail(const Detail&);
  Detail(Detail&&) noexcept;
  Detail& operator=(const Detail&);
  Detail& operator=(Detail&&) noexcept;
  ~Detail();
};

struct Completed {
  Outcome outcome = Outcome::kDone;
  std::string reason{};  // names motor and cause; never empty
  Detail detail{};
};

struct Reply : std::variant<Accepted, Refused, Completed> {
  using variant::variant;
  Reply();
  Reply(const Reply&);
  Reply(Reply&&) noexcept;
  Reply& operator=(const Reply&);
  Reply& operator=(Reply&&) noexcept;
  ~Reply();
};

Completed done(std::string reason);

// "" of one that was accepted.
std::string reason_of(const Reply& reply);

// Nothing follows it.
inline bool is_final(const Reply& reply) {
  return !std::holds_alternative<Accepted>(reply);
}

// About how much memory it takes, for bounds.
std::size_t memory_of(const Reply& reply);

}  // namespace bushd::api
