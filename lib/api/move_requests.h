// Requests that move motors to positions: moves, lines, paths, and positions in time. (What all
// requests have in common: api/request.h. How a type declares its fields: base/fields.h.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/words.h"
#include "base/fields.h"

namespace bushd::api {

struct MotorAmount {
  std::string motor{};
  Amount amount{};
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    amount_fields(self.amount, visit);
  }
  static void amount_fields(auto& amount, auto& visit) {
    const auto* told = std::get_if<std::int64_t>(&amount);
    bool in_steps = told != nullptr;
    std::int64_t steps = in_steps ? *told : 0;
    double user = in_steps ? 0 : std::get<UserUnits>(amount).value;
    visit("in_steps", in_steps);
    visit("steps", steps);
    visit("user", user);
    visit.set(amount, in_steps ? Amount{steps} : Amount{UserUnits{user}});
  }
  friend bool operator==(const MotorAmount&, const MotorAmount&) = default;
};

using MotorNames = std::vector<std::string>;

// Fields that several requests have.
inline void names_fields(auto& self, auto& visit) {
  visit.list("motor_count", "motors", self.motors);
}
// 0 a second is none.
inline void speed_fields(auto& speed, auto& visit) {
  Speed told = speed.value_or(Speed{});
  visit("speed", told.per_s);
  visit("speed_in_steps", told.in_steps);
  visit.set(speed, told.per_s == 0 ? std::optional<Speed>{} : told);
}
// Along the way of several motors, in the unit that they share.
inline void feed_fields(auto& feed, auto& visit) {
  Speed told = feed.value_or(Speed{});
  visit("feed", told.per_s);
  visit("feed_in_steps", told.in_steps);
  visit.set(feed, told.per_s == 0 ? std::optional<Speed>{} : told);
}
inline constexpr fields::OneOf<2> kEdge{};  // RISING, FALLING
inline constexpr fields::NoneIs<double> kNoDuration{0};

// One group move: the motors of one bus start in the same tick. A motor that moves is given a new
// target; its part in the move before ends with kStopped.
// Result: the worst outcome of its motors, and one MotorResult each. Refused as a whole if one
// motor cannot move.
struct Move {
  enum class Kind {
    kRelative,  // by so much, of a motor that moves from the target that it was given
    kAbsolute   // to this position
  };
  static constexpr fields::OneOf<2> kKind{};
  Kind kind = Kind::kRelative;
  std::vector<MotorAmount> motors{};  // at least one, none twice
  bool dry_run = false;          // from rest only: result kDone with a MovePlan, and nothing moves
  std::optional<Speed> speed{};  // none: as fast as the motors' tables and max_speed allow

  static constexpr std::string_view kName = "move";
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, kKind);
    visit("dry_run", self.dry_run);
    speed_fields(self.speed, visit);
    names_fields(self, visit);
  }
};

// Motors of one bus move along a straight line: at any moment each has made the same share of its
// way, as nearly as steps allow, and no motor steps faster than its table allows. By the elementary
// law, of motors of one MCU, one motor makes one step at a time. A motor with
// backlash that comes from the wrong side makes its last approach, on a line too, when all have
// arrived. The same motors, while they move, may be given an end of the same line that is nearer,
// or another speed. Stops, pauses and limits of one of them ramp all down along the line.
// Result: as of Move; the reason names the motor that limits the line, and how far motors are off
// it.
struct MoveLine {
  Move::Kind kind = Move::Kind::kRelative;
  std::vector<MotorAmount> motors{};   // at least one, at most kMostMotors, none twice
  bool dry_run = false;                // from rest only: result kDone with a MovePlan
  std::optional<Speed> speed{};        // no motor exceeds it; none: as fast as tables allow
  std::optional<double> duration_s{};  // not shorter than this; refused if it cannot be so slow
  enum class Law {
    kLeading,    // the motor with most steps leads, and others step with it (engine/line.h)
    kElementary  // an evaluation function as it is printed (engine/elementary.h)
  };
  Law law = Law::kLeading;
  // Along the way, not to be exceeded; motors with one unit. By the elementary law that of
  // elementary steps: all motors have the same steps per unit.
  std::optional<Speed> feed{};

  static constexpr std::size_t kMostMotors = 127;

  static constexpr std::string_view kName = "move line";
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, Move::kKind);
    visit("dry_run", self.dry_run);
    speed_fields(self.speed, visit);
    visit("duration_s", self.duration_s, kNoDuration);
    visit("law", self.law, fields::OneFrom0<2>{});
    feed_fields(self.feed, visit);
    names_fields(self, visit);
  }
};

// Motors of one bus move from where they stand to the first of these points and on from point to
// point, along straight lines and by one run. Points may come in several requests of a client, one
// after the other: each but the last has kDone as its result as soon as it is taken, and the last
// one begins the motion. The first one drops what the client has not finished. Motors make no last
// approach for backlash. Stops, pauses and limits of one of them ramp all down along the path.
// Result: as of MoveLine.
struct MovePath {
  enum class Corners {
    kContinuous,  // passed at speeds at which no motor jumps by more than it starts with from rest
    kExact        // rest at each point
  };
  MotorNames motors{};         // at least one, at most MoveLine::kMostMotors, none twice
  std::int32_t rows = 0;       // points of the whole path, 1..kMostRows
  std::int32_t first_row = 0;  // of this request; as many as have been taken before
  std::vector<double>
      positions{};  // of all motors, row by row, in their units; not above kMostValues
  // Speeds that a single motor does not exceed on the way to each row; 0: as below. None, or as
  // many as rows.
  std::vector<double> speeds{};
  Corners corners = Corners::kContinuous;
  bool dry_run = false;          // result kDone with a MovePlan
  std::optional<Speed> speed{};  // no motor exceeds it; none: as fast as tables allow
  std::optional<Speed> feed{};   // along the way, not to be exceeded; motors with one unit

  static constexpr std::int32_t kMostRows = 100'000;
  static constexpr std::size_t kMostValues = 4096;

  static constexpr std::string_view kName = "move path";
  static void fields(auto& self, auto& visit) {
    visit("rows", self.rows);
    visit("first_row", self.first_row);
    visit("corners", self.corners, fields::OneOf<2>{});
    visit("dry_run", self.dry_run);
    speed_fields(self.speed, visit);
    feed_fields(self.feed, visit);
    names_fields(self, visit);
    visit.list("position_count", "positions", self.positions);
    visit.list("speed_count", "speeds", self.speeds);
  }
};

// Motors of one bus, at rest, follow a trajectory: positions in time. Its rows come in parts, each
// a request of its own, which is answered when the trajectory has been checked as far as it is
// known: kDone if all of its motors can follow it, with a MovePlan after the last row, otherwise
// kFault, and the trajectory is dropped. The first row is where the motors stand. kRun begins the
// motion. Further rows may be told while it runs; a trajectory that comes to its end in motion, or
// without its last row, ramps its motors down by their tables. Result of kRun: as of Move.
struct Follow {
  enum class Part { kRows, kLastRows, kRun };
  static constexpr std::size_t kMostMotors = 127;
  static constexpr std::size_t kMostRows = 100'000;       // of a trajectory
  static constexpr std::size_t kMostNumbers = 1'000'000;  // positions of a trajectory

  Part part = Part::kRows;
  std::int64_t array = 0;  // its number, the client's own
  // Alike in all parts:
  MotorNames motors{};  // at least one, none twice
  bool cubic = false;   // between rows; else linear
  double stretch = 1;   // all times are so many times as long, 0.001..1000
  // In kRows and kLastRows:
  std::vector<double> time_s{};     // each later than the one before, below 10^8
  std::vector<double> positions{};  // user units, row by row: one for each motor

  static constexpr std::string_view kName = "follow";
  static void fields(auto& self, auto& visit) {
    visit("part", self.part, fields::OneOf<3>{});
    visit("array", self.array);
    visit("cubic", self.cubic);
    visit("stretch", self.stretch);
    names_fields(self, visit);
    visit.list("row_count", "time_s", self.time_s);
    visit.list("position_count", "positions", self.positions);
  }
};

}  // namespace bushd::api
