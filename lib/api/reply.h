// What is said to a request: Refused and nothing more, or Accepted and later exactly one Completed;
// Completed alone where a request is over with its answer (one that a stop has ended before it was
// carried out, and a stop that could not stop all).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/words.h"
#include "heritage/camac/naf.h"
#include "tables/table.h"

namespace bushd::api {

// Which table it is, in short.
struct TableRef {
  std::string name{};
  std::uint32_t revision = 0;  // counted by bushtab from 1; 0: the table's file tells none
  std::string hash{};          // first 8 digits of the SHA-256 of what moves a motor
  friend bool operator==(const TableRef&, const TableRef&) = default;
};
TableRef ref_to(const tables::Table& table);

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
};

// What a move would be.
struct MovePlan {
  struct Motor {
    std::string motor{};
    std::int64_t steps = 0;
    std::int64_t duration_us = 0;  // to its last step
    double peak_steps_per_s = 0;
  };
  // Of the motion alone: no polls, synchronisation and repeats.
  struct Traffic {
    std::int64_t frames = 0;
    std::int64_t bytes = 0;  // on the line
  };
  std::int64_t duration_us = 0;  // from the first tick to the end of the last one
  std::int64_t ticks = 0;
  std::optional<Traffic> traffic{};  // none: it is too much to be counted
  std::string limited_by{};          // of a line: the motor that makes it take so long
  std::vector<Motor> motors{};       // in the request's order, each leg of a motor by itself
  // Of a path of at most kMostPoints: when each of its points is reached, from the first tick on.
  std::vector<std::int64_t> points_us{};
  static constexpr std::size_t kMostPoints = 2048;
};

// One of the tables that the daemon finds.
struct TableEntry {
  std::string name{};   // its file's name without ".toml"
  std::string fault{};  // why it cannot be used; "": it can, and the rest means something
  TableRef table{};
  std::int32_t codes = 0;  // of both sides, of one if they mirror each other
  double start_steps_per_s = 0;
  double max_steps_per_s = 0;
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
  friend bool operator==(const PastMotion&, const PastMotion&) = default;
};
struct MotionHistory {
  std::vector<PastMotion> motions{};
};

// What may be changed in operation, and what bushd.toml says of it.
struct MotorSetting {
  std::string motor{};
  std::string key{};
  std::string value{};
  std::string in_file{};
  friend bool operator==(const MotorSetting&, const MotorSetting&) = default;
};
struct Configuration {
  std::string path{};    // of bushd.toml, absolute, on the daemon's PC
  std::string sha256{};  // of its text as the daemon knows it
  std::vector<MotorSetting> settings{};
};

// What a crate has answered.
struct CamacResult {
  camac::BlockResult block{};
  std::uint32_t requests = 0;  // L lines of its stations afterwards; bit n - 1 is station n
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
                             tables::TableContent, MotionHistory, Configuration, CamacResult> {
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
