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

  static constexpr std::string_view kName = "motor amount";
  static constexpr std::string_view kMeaning = "One motor and a position or a distance.";
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    amount_fields(self.amount, visit);
  }
  static void amount_fields(auto& amount, auto& visit) {
    const auto* told = std::get_if<std::int64_t>(&amount);
    bool in_steps = told != nullptr;
    std::int64_t steps = in_steps ? *told : 0;
    double user = in_steps ? 0 : std::get<UserUnits>(amount).value;
    visit({"in_steps", "it is told by steps; else by user"}, in_steps);
    visit({"steps", fields::Unit{"steps"}, ""}, steps);
    visit({"user", kMotorUnit, "on the user's scale; steps of a motor without a unit"}, user);
    visit.set(amount, in_steps ? Amount{steps} : Amount{UserUnits{user}});
  }
  friend bool operator==(const MotorAmount&, const MotorAmount&) = default;
};

using MotorNames = std::vector<std::string>;

// Fields that several requests have.
inline void names_fields(auto& self, auto& visit, const fields::Field& names = "motors",
                         const fields::Field& count = "motor_count") {
  visit.list(count, names, self.motors);
}
// Where no name means all. A type that takes groups, too, says so by kNamesGroups.
inline void names_or_all_fields(auto& self, auto& visit) {
  constexpr bool kGroups = requires { self.kNamesGroups; };
  names_fields(
      self, visit,
      {"motors", kGroups ? "motors or groups; none named: all" : "motors; none named: all"});
}
inline constexpr fields::Field kOneMotorOrMore{"motor_count", "at least 1, none twice"};
// 0 a second is none.
inline void speed_fields(
    auto& speed, auto& visit,
    const char* meaning = "no motor exceeds it; 0: as fast as tables and max_speed allow") {
  Speed told = speed.value_or(Speed{});
  visit({"speed", kMotorUnitPerS, meaning}, told.per_s);
  visit({"speed_in_steps", "the speed is in steps/s"}, told.in_steps);
  visit.set(speed, told.per_s == 0 ? std::optional<Speed>{} : told);
}
// Along the way of several motors, in the unit that they share.
inline void feed_fields(auto& feed, auto& visit) {
  Speed told = feed.value_or(Speed{});
  visit(
      {"feed", kMotorUnitPerS,
       "along the way, of motors with one unit, not to be exceeded; 0: as fast as all else allows"},
      told.per_s);
  visit({"feed_in_steps", "the feed is in steps/s"}, told.in_steps);
  visit.set(feed, told.per_s == 0 ? std::optional<Speed>{} : told);
}
inline constexpr fields::Field kDryRun{
    "dry_run", "from rest: the result is done, with the plan of the move; nothing moves"};
inline constexpr fields::Field kDuration{
    "duration_s",
    "not shorter than this; 0: as short as all else allows. Refused if motors cannot "
    "be so slow"};
inline constexpr fields::NoneIs<double> kNoDuration{0};
inline constexpr fields::OneOf kEdge{
    {{"RISING", "where the input becomes active"}, {"FALLING", "where it becomes inactive"}}};

struct Move {
  enum class Kind { kRelative, kAbsolute };
  static constexpr fields::OneOf kKind{
      {{"RELATIVE", "by so much, counted from the present target of a motor that moves"},
       {"ABSOLUTE", "to this position"}}};

  Kind kind = Kind::kRelative;
  std::vector<MotorAmount> motors{};
  bool dry_run = false;
  std::optional<Speed> speed{};

  static constexpr std::string_view kName = "move";
  static constexpr std::string_view kMeaning =
      "One group move: motors of one bus start in the same tick. A motor that moves is given a new "
      "target; its part in the move before ends with stopped. Refused as a whole if one motor "
      "cannot move. The outcome is the worst of its motors.";
  static constexpr std::string_view kResult = "reached; of a dry run done";
  Motion motion() const { return dry_run ? Motion::kNone : Motion::kBegins; }
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, kKind);
    visit(kDryRun, self.dry_run);
    speed_fields(self.speed, visit);
    names_fields(self, visit, "motors", kOneMotorOrMore);
  }
  friend bool operator==(const Move&, const Move&) = default;
};

struct MoveLine {
  enum class Law { kLeading, kElementary };  // engine/line.h, engine/elementary.h
  static constexpr fields::Range<std::size_t> kMotors{1, 127};
  static constexpr fields::Field kMotorCount{"motor_count", "none twice", kMotors};

  Move::Kind kind = Move::Kind::kRelative;
  std::vector<MotorAmount> motors{};
  bool dry_run = false;
  std::optional<Speed> speed{};
  std::optional<double> duration_s{};
  Law law = Law::kLeading;
  std::optional<Speed> feed{};

  static constexpr fields::OneFrom0 kLaw{
      {{"LEADING", "the motor with most steps leads, and others step with it"},
       {"ELEMENTARY",
        "one step of one motor at a time, of motors of one MCU; with a feed they have "
        "the same steps per unit"}}};
  static constexpr std::string_view kName = "move line";
  static constexpr std::string_view kMeaning =
      "Motors of one bus move along a straight line: at any moment each has made the same share of "
      "its way, as nearly as steps allow. Those that move on a line may be given an end of the "
      "same line that is nearer, or another speed. A motor with backlash that comes from the wrong "
      "side makes its last approach, on a line too, when all have arrived. Stops, pauses and "
      "limits of one of them ramp all down along the line. The reason of the result names the "
      "motor that limits the line, and how far motors are off it.";
  static constexpr std::string_view kResult = "reached; of a dry run done";
  Motion motion() const { return dry_run ? Motion::kNone : Motion::kBegins; }
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, Move::kKind);
    visit(kDryRun, self.dry_run);
    speed_fields(self.speed, visit);
    visit(kDuration, self.duration_s, kNoDuration);
    visit("law", self.law, kLaw);
    feed_fields(self.feed, visit);
    names_fields(self, visit, "motors", kMotorCount);
  }
  friend bool operator==(const MoveLine&, const MoveLine&) = default;
};

struct MovePath {
  enum class Corners { kContinuous, kExact };
  static constexpr fields::Range<std::int32_t> kRows{1, 100'000};
  static constexpr fields::Range<std::size_t> kValues{1, 4096};  // of one request

  MotorNames motors{};
  std::int32_t rows = 0;
  std::int32_t first_row = 0;
  std::vector<double> positions{};
  std::vector<double> speeds{};
  Corners corners = Corners::kContinuous;
  bool dry_run = false;
  std::optional<Speed> speed{};
  std::optional<Speed> feed{};

  static constexpr fields::OneOf kCorners{
      {{"CONTINUOUS",
        "passed at speeds at which no motor jumps by more than it starts with from rest"},
       {"EXACT", "rest at each point"}}};
  static constexpr std::string_view kName = "move path";
  static constexpr std::string_view kMeaning =
      "Motors of one bus move from where they stand to the first of these points and on from point "
      "to point, along straight lines and by one run. Points may come in several requests of a "
      "client, one after the other: each but the last has done as its result as soon as it is "
      "taken, and the last one begins the motion. The first one drops what the client has not "
      "finished. Motors make no last approach for backlash. Stops, pauses and limits of one of "
      "them ramp all down along the path.";
  static constexpr std::string_view kResult =
      "reached; of a dry run, and of points that others follow, done";
  static constexpr Motion motion() { return Motion::kBeginsByService; }
  static void fields(auto& self, auto& visit) {
    visit({"rows", "points of the whole path", kRows}, self.rows);
    visit({"first_row", "of this request; as many as have been taken before"}, self.first_row);
    visit("corners", self.corners, kCorners);
    visit(kDryRun, self.dry_run);
    speed_fields(self.speed, visit);
    feed_fields(self.feed, visit);
    names_fields(self, visit, "motors", MoveLine::kMotorCount);
    visit.list({"position_count", "a multiple of motor_count", kValues},
               {"positions", kMotorUnit, "of all motors, row by row"}, self.positions);
    visit.list({"speed_count", "of a single motor: as many as rows; else 0"},
               {"speeds", kMotorUnitPerS, "not to be exceeded on the way to that row; 0: `speed`"},
               self.speeds);
  }
  friend bool operator==(const MovePath&, const MovePath&) = default;
};

struct Follow {
  enum class Part { kRows, kLastRows, kRun };
  static constexpr std::size_t kMostRows = 100'000;       // of a trajectory
  static constexpr std::size_t kMostNumbers = 1'000'000;  // positions of a trajectory

  Part part = Part::kRows;
  std::int64_t array = 0;
  MotorNames motors{};
  bool cubic = false;
  double stretch = 1;
  std::vector<double> time_s{};
  std::vector<double> positions{};

  static constexpr fields::Range<double> kStretch{0.001, 1000};
  static constexpr fields::OneOf kPart{
      {{"ROWS"}, {"LAST_ROWS", "no row follows these"}, {"RUN", "has no rows"}}};
  static constexpr std::string_view kName = "follow";
  static constexpr std::string_view kMeaning =
      "Motors of one bus, at rest, follow a trajectory: positions in time. Its rows come in parts, "
      "each a request of its own, which is answered when the trajectory has been checked as far as "
      "it is known: done if all motors can follow it, with a plan after the last row, otherwise "
      "fault, and the trajectory is dropped. The first row is where the motors stand. RUN begins "
      "the motion. Further rows may be told while it runs; a trajectory that comes to its end in "
      "motion, or without its last row, ramps its motors down by their tables.";
  static constexpr std::string_view kResult =
      "of rows done, when they have been checked; of RUN reached";
  static constexpr Motion motion() { return Motion::kBeginsByService; }
  static void fields(auto& self, auto& visit) {
    visit("part", self.part, kPart);
    visit({"array",
           "the client's number for it, the same in all parts, as are the fields up to the rows"},
          self.array);
    visit({"cubic", "between rows; else linear"}, self.cubic);
    visit({"stretch", "all times are so many times as long", kStretch}, self.stretch);
    names_fields(self, visit, "motors", MoveLine::kMotorCount);
    visit.list("row_count", {"time_s", "each later than the one before, below 10^8"}, self.time_s);
    visit.list({"position_count", "row_count times motor_count"},
               {"positions", kMotorUnit, "row by row: one for each motor"}, self.positions);
  }
  friend bool operator==(const Follow&, const Follow&) = default;
};

}  // namespace bushd::api
