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

struct TableRef {
  std::string name{};
  std::uint32_t revision = 0;
  std::string hash{};
  static constexpr std::size_t kHashLength = 8;  // digits

  static constexpr std::string_view kName = "table ref";
  static constexpr std::string_view kMeaning = "Which table it is, in short.";
  static void fields(auto& self, auto& visit) {
    visit("name", self.name);
    visit({"revision", "counted by bushtab from 1; 0: the table's file tells none"}, self.revision,
          fields::OrZero<std::int32_t>{INT32_MAX});
    visit({"hash", "the first 8 digits of the SHA-256 of what moves a motor (docs/tables.md)"},
          self.hash);
  }
  friend bool operator==(const TableRef&, const TableRef&) = default;
};

// A number of decimals.
inline constexpr fields::Range<int> kDecimals{0, units::Coordinates::kMostDecimals};
struct Decimals {
  static std::int8_t told(int decimals) { return static_cast<std::int8_t>(decimals); }
  static bool taken(std::int8_t told, int& decimals) {
    decimals = std::clamp<int>(told, kDecimals.least, kDecimals.most);
    return true;
  }
};

struct MotorResult {
  std::string motor{};
  Outcome outcome = Outcome::kFault;
  std::int64_t position_steps = 0;
  double user = 0;
  double dial = 0;
  std::string unit = "steps";
  int precision = 0;
  TableRef table{};
  std::string who{};
  int legs = 1;
  double most_steps_per_s = 0;

  static constexpr std::string_view kName = "motor result";
  static constexpr std::string_view kMeaning = "What became of one motor of a move.";
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit({"outcome", "as in reply_header_t"}, self.outcome, fields::Word{outcome_of});
    visit({"position_steps", "where its MCU says that it stands"}, self.position_steps);
    visit({"user_position", kMotorUnit, "the same on the user's scale"}, self.user);
    visit({"dial_position", kMotorUnit, "the same on the dial"}, self.dial);
    visit({"unit", "\"steps\" of a motor without one"}, self.unit);
    visit({"precision", "decimals of both positions for people", kDecimals}, self.precision,
          Decimals{});
    visit({"table", "by which it has moved"}, self.table);
    visit({"asked_by", "who asked for it"}, self.who);
    visit({"legs", "how many its motion had, as planned"}, self.legs, fields::As<std::int8_t>{});
    visit({"most_steps_per_s", "not exceeded by any of them; 0 of what the MCU makes by itself"},
          self.most_steps_per_s);
  }
  friend bool operator==(const MotorResult&, const MotorResult&) = default;
};

struct MovePlan {
  struct Motor {
    std::string motor{};
    std::int64_t steps = 0;
    std::int64_t duration_us = 0;
    double peak_steps_per_s = 0;

    static constexpr std::string_view kName = "planned motor";
    static constexpr std::string_view kMeaning = "One leg of one motor of a planned move.";
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit({"steps", fields::Unit{"steps"}, ""}, self.steps);
      visit({"duration_us", "to its last step"}, self.duration_us);
      visit("peak_steps_per_s", self.peak_steps_per_s);
    }
    friend bool operator==(const Motor&, const Motor&) = default;
  };
  // Frames of the motion alone: no polls, synchronisation and repeats.
  struct Traffic {
    std::int64_t frames = 0;
    std::int64_t bytes = 0;
    friend bool operator==(const Traffic&, const Traffic&) = default;
  };
  std::int64_t duration_us = 0;
  std::int64_t ticks = 0;
  std::optional<Traffic> traffic{};
  std::string limited_by{};
  std::vector<Motor> motors{};
  std::vector<std::int64_t> points_us{};
  static constexpr std::size_t kMostPoints = 2048;

  static constexpr std::string_view kName = "move plan";
  static constexpr std::string_view kMeaning = "What a move would be.";
  static void fields(auto& self, auto& visit) {
    Traffic traffic = self.traffic.value_or(Traffic{.frames = -1, .bytes = -1});
    visit({"duration_us", "from the first tick to the end of the last one"}, self.duration_us);
    visit({"ticks", "so many"}, self.ticks);
    const fields::If counted{self.traffic.has_value()};
    visit({"frames",
           "to the MCUs, for the motion alone: no polls, synchronisation and repeats; -1: too many "
           "to be counted"},
          traffic.frames, counted);
    visit({"bytes", "of these frames on the bus"}, traffic.bytes, counted);
    visit({"limited_by", "of a line: the motor that makes it take so long; else \"\""},
          self.limited_by, fields::If{!self.limited_by.empty()});
    visit.list("motor_count", {"motors", "in the request's order, each leg of a motor by itself"},
               self.motors);
    visit.list({"point_count", "of a path of at most 2048 points: all; else 0"},
               {"points_us", "when each of them is reached, from the first tick on"},
               self.points_us);
    visit.set(self.traffic, traffic.frames < 0 ? std::optional<Traffic>{} : traffic);
  }
  friend bool operator==(const MovePlan&, const MovePlan&) = default;
};

struct TableEntry {
  std::string name{};
  std::string fault{};
  TableRef table{};
  std::int32_t codes = 0;
  double start_steps_per_s = 0;
  double max_steps_per_s = 0;

  static constexpr std::string_view kName = "table entry";
  static constexpr std::string_view kMeaning = "One of the tables that the daemon finds.";
  static void fields(auto& self, auto& visit) {
    visit({"name", "by which it is asked for: its file's name without \".toml\""}, self.name);
    const fields::If good{self.fault.empty()};
    visit("table", self.table, good);
    visit({"fault", "why it cannot be used; \"\": it can, and the rest means something"},
          self.fault);
    visit({"codes", "of both sides, of one if they mirror each other"}, self.codes, good);
    visit("start_steps_per_s", self.start_steps_per_s, good);
    visit("max_steps_per_s", self.max_steps_per_s, good);
  }
  friend bool operator==(const TableEntry&, const TableEntry&) = default;
};
struct TableList {
  std::vector<TableEntry> entries{};
  friend bool operator==(const TableList&, const TableList&) = default;
};

struct PastMotion {
  std::int64_t utime_us = 0;
  std::string what{};
  std::string who{};
  std::int64_t from_steps = 0;
  std::int64_t to_steps = 0;
  std::string outcome{};
  std::string reason{};
  std::string from_text{};
  std::string to_text{};

  static constexpr std::string_view kName = "past motion";
  static constexpr std::string_view kMeaning =
      "What has moved a motor, or made its position known.";
  static void fields(auto& self, auto& visit) {
    visit({"utime_us", "when it ended, microseconds since 1970"}, self.utime_us);
    visit({"what",
           "\"move\", \"home\", \"arm\", \"jog\", \"line\", \"travel\", \"set\", \"config\" or "
           "\"confirm\""},
          self.what);
    visit({"who", "who asked for it"}, self.who);
    visit("from_steps", self.from_steps);
    visit({"to_steps", "where the motor stood in the end"}, self.to_steps);
    visit({"outcome", "as in answer_t"}, self.outcome);
    visit("reason", self.reason);
    visit({"from_text",
           "as it was shown to people then: \"12.345 mm\"; \"\" of a motor without a unit"},
          self.from_text);
    visit({"to_text", "the same of where it stood"}, self.to_text);
  }
  friend bool operator==(const PastMotion&, const PastMotion&) = default;
};
struct MotionHistory {
  std::vector<PastMotion> motions{};

  static constexpr std::string_view kName = "history answer";
  static constexpr std::string_view kMeaning = "Answers get_history_t.";
  static void fields(auto& self, auto& visit) {
    visit.list("motion_count", {"motions", "the newest first; in parts"}, self.motions);
  }
  friend bool operator==(const MotionHistory&, const MotionHistory&) = default;
};

struct MotorSetting {
  std::string motor{};
  std::string key{};
  std::string value{};
  std::string in_file{};

  static constexpr std::string_view kName = "motor setting";
  static constexpr std::string_view kMeaning = "What may be changed of a motor in operation.";
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit("key", self.key);
    visit({"value", "now, as in motor_change_t"}, self.value);
    visit({"value_in_file", "in bushd.toml"}, self.in_file);
  }
  friend bool operator==(const MotorSetting&, const MotorSetting&) = default;
};
struct Configuration {
  std::string path{};
  std::string sha256{};
  std::vector<MotorSetting> settings{};

  static constexpr std::string_view kName = "configuration answer";
  static constexpr std::string_view kMeaning = "Answers configure_t.";
  static void fields(auto& self, auto& visit) {
    visit({"path", "of bushd.toml, absolute, on the daemon's PC"}, self.path);
    visit({"sha256", "of its text as the daemon knows it"}, self.sha256);
    visit.list("setting_count", {"settings", "in parts"}, self.settings);
  }
  friend bool operator==(const Configuration&, const Configuration&) = default;
};

struct CamacResult {
  camac::BlockResult block{};
  std::uint32_t requests = 0;

  static constexpr std::string_view kName = "camac reply";
  static constexpr std::string_view kMeaning = "Answers camac_request_t.";
  static void fields(auto& self, auto& visit) {
    visit({"tally", "words that were moved; of SINGLE cycles that were made"}, self.block.tally);
    visit({"requests", "stations that raise L afterwards: bit n - 1 is station n"}, self.requests);
    visit.list("response_count",
               {"responses",
                "of the cycles that moved a word, and of the one that ended a block at one "
                "address; in parts"},
               self.block.responses);
  }
  friend bool operator==(const CamacResult&, const CamacResult&) = default;
};

struct ProgramEntry {
  struct Motor {
    std::string motor{};
    std::int64_t least_steps = 0;
    std::int64_t most_steps = 0;
    std::int64_t end_steps = 0;
    std::int64_t edges = 0;

    static constexpr std::string_view kName = "program motor";
    static constexpr std::string_view kMeaning =
        "What a program does to a motor, from where the motor stands; of a repeat without end one "
        "pass.";
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit({"least_steps", "where it comes to, its beginning included"}, self.least_steps);
      visit("most_steps", self.most_steps);
      visit("end_steps", self.end_steps);
      visit({"edges", fields::Unit{"steps"}, "that it makes"}, self.edges);
    }
    friend bool operator==(const Motor&, const Motor&) = default;
  };
  std::string mcu{};
  std::string program{};
  std::string checksum{};
  std::string stage{};
  std::string reason{};
  bool without_host = false;
  bool at_power_on = false;
  bool kept = false;
  bool stored = false;
  std::int32_t bytes = 0;
  std::int32_t memory = 0;
  std::int32_t frame = 0;
  std::int32_t point = 0;
  std::int64_t repeats = 0;
  std::int64_t duration_us = 0;
  std::int64_t pulses = 0;
  bool endless = false;
  bool waits_for_inputs = false;
  bool cut = false;
  std::vector<Motor> motors{};

  static constexpr std::string_view kName = "program";
  static constexpr std::string_view kMeaning = "The program of an MCU.";
  static void fields(auto& self, auto& visit) {
    visit("mcu", self.mcu);
    visit({"program", "its name; \"\": none, or one that the daemon does not know"}, self.program);
    visit({"checksum", "CRC-32 of its bytes, 8 hexadecimal digits; \"\": the MCU has none"},
          self.checksum);
    visit({"stage",
           "\"none\", \"loading\", \"loaded\", \"waits\", \"runs\", \"pauses\", \"paused\", "
           "\"ends\", \"ended\" or \"unknown\""},
          self.stage);
    visit({"reason", "why its last run has ended, in words; \"\": it has not"}, self.reason);
    visit({"without_host", "it goes on when no host is heard"}, self.without_host);
    visit({"at_power_on", "it begins by itself when the power comes"}, self.at_power_on);
    visit({"kept", "it is to outlive power cuts"}, self.kept);
    visit({"stored", "and would now"}, self.stored);
    visit({"bytes", "of it, or of what has arrived of it"}, self.bytes);
    visit({"memory", "bytes that one may have"}, self.memory);
    visit({"frame", "that is carried out, or was last, from 1; 0: none yet"}, self.frame);
    visit({"point", "of it, if it is a line, from 1"}, self.point);
    visit("repeats", self.repeats);
    visit({"duration_us",
           "without the time in which it waits for inputs; this and what follows: by a walk "
           "through its frames, of a program that this daemon has checked"},
          self.duration_us);
    visit("pulses", self.pulses);
    visit({"endless", "it repeats without end: what is told is of one pass"}, self.endless);
    visit("waits_for_inputs", self.waits_for_inputs);
    visit({"cut", "there are more frames to carry out than were looked at"}, self.cut);
    visit.list("motor_count", "motors", self.motors);
  }
  friend bool operator==(const ProgramEntry&, const ProgramEntry&) = default;
};
struct ProgramList {
  std::vector<ProgramEntry> programs{};

  static constexpr std::string_view kName = "program reply";
  static constexpr std::string_view kMeaning = "Answers put_program_t and list_programs_t.";
  static void fields(auto& self, auto& visit) {
    visit.list("program_count", {"programs", "in parts"}, self.programs);
  }
  friend bool operator==(const ProgramList&, const ProgramList&) = default;
};

struct Accepted {
  friend bool operator==(const Accepted&, const Accepted&) = default;
};

struct Refused {
  std::string reason{};
  friend bool operator==(const Refused&, const Refused&) = default;
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
  std::string reason{};
  Detail detail{};
  friend bool operator==(const Completed&, const Completed&) = default;
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
