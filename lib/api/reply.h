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

struct Accepted {};

struct Refused {
  std::string reason{};  // what, why with the figure, what to do
};

// Motors of moves, homing and arming, in the request's order; a plan of a dry run; answers of the
// table requests; a history; settings; of a crate. (Its copies are compiled once, not in every file
// that has one. So are those of Reply and Request.)
struct Detail : std::variant<std::monostate, std::vector<MotorResult>, MovePlan, TableList,
                             TableFile, MotionHistory, Configuration, CamacResult> {
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
