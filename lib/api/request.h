// Everything that can be asked of the daemon: one type per request. A new request is a new type
// here, a service in the core and a message in the front ends; no other request changes.
//
// Motors and groups are named as in the configuration. Front ends pass names and numbers as they
// come, however wrong: the core resolves them, checks every range and refuses with a reason. So the
// ranges below are those that are accepted, not preconditions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "api/words.h"
#include "heritage/camac/naf.h"
#include "tables/table.h"

namespace bushd::api {

struct MotorAmount {
  std::string motor{};
  Amount amount{};
  friend bool operator==(const MotorAmount&, const MotorAmount&) = default;
};

using MotorNames = std::vector<std::string>;

// One group move: the motors of one bus start in the same tick. A motor that moves is given a new
// target; its part in the move before ends with kStopped.
// Result: the worst outcome of its motors, and one MotorResult each. Refused as a whole if one
// motor cannot move.
struct Move {
  enum class Kind {
    kRelative,  // by so much, of a motor that moves from the target that it was given
    kAbsolute   // to this position
  };
  Kind kind = Kind::kRelative;
  std::vector<MotorAmount> motors{};  // at least one, none twice
  bool dry_run = false;          // from rest only: result kDone with a MovePlan, and nothing moves
  std::optional<Speed> speed{};  // none: as fast as the motors' tables and max_speed allow
};

// Motors of one bus move along a straight line: at any moment each has made the same share of its
// way, as nearly as steps allow, and no motor steps faster than its table allows. A motor with
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
  // Of CAMAC modules, no front end tells it: what a motor that is alone moves by, in place of its
  // own table. Its MCU need not have it, and ramps the motor down by the own one when the link is
  // lost; so no delay of this move may be shorter than any of that.
  tables::TablePtr by = {};

  static constexpr std::size_t kMostMotors = 127;
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
  // Of a single motor only: its speed is not exceeded on the way to that row; 0: as below. None, or
  // as many as rows.
  std::vector<double> speeds{};
  Corners corners = Corners::kContinuous;
  bool dry_run = false;          // result kDone with a MovePlan
  std::optional<Speed> speed{};  // no motor exceeds it; none: as fast as tables allow

  static constexpr std::int32_t kMostRows = 100'000;
  static constexpr std::size_t kMostValues = 4096;
};

// Motors of one bus, at rest, follow positions in time. The rows of an array come in parts, each
// a request of its own, which is answered when the array has been checked as far as it is known:
// kDone if all of its motors can follow it, with a MovePlan after the last row, otherwise kFault,
// and the array is dropped. The first row is where the motors stand. kRun begins the motion.
// Further rows may be told while it runs; an array that comes to its end in motion, or without its
// last row, ramps its motors down by their tables.
// Result of kRun: as of Move.
struct Follow {
  enum class Part { kRows, kLastRows, kRun };
  static constexpr std::size_t kMostMotors = 127;
  static constexpr std::size_t kMostRows = 100'000;       // of an array
  static constexpr std::size_t kMostNumbers = 1'000'000;  // positions of an array

  Part part = Part::kRows;
  std::int64_t array = 0;  // its number, the client's own
  // Of all parts alike:
  MotorNames motors{};  // at least one, none twice
  bool cubic = false;   // between rows; else linear
  double stretch = 1;   // all times are so many times as long, 0.001..1000
  // Of kRows and kLastRows:
  std::vector<double> time_s{};     // each later than the one before, below 10^8
  std::vector<double> positions{};  // user units, row by row: one for each motor
};

// Ramps these motors down; none named: all. Result kDone once they stand. Also disarms, and ends
// homing. Never refused, but for an unknown motor.
struct Stop {
  MotorNames motors{};
};

// Stops all motors of all buses as the configuration says (StopMode), and latches the stop in every
// MCU until ClearFaults. Never refused. Result kDone once all MCUs that are online stand.
struct EmergencyStop {};

// Drivers of the MCUs of these motors on or off; none named: of all. Disable is refused while one
// of them moves.
struct Enable {
  MotorNames motors{};
};
struct Disable {
  MotorNames motors{};
};

// Says where these motors, at rest, stand. In user units, of a motor that has a unit: changes the
// offset, so that where it stands is this user position. Otherwise, and with `dial`: sets the
// position, which is known then.
struct SetPosition {
  std::vector<MotorAmount> motors{};  // at least one
  bool dial = false;                  // user units are those of the dial
};

// Clears latched faults of the MCUs of these motors, none named: of all. Refused while one moves.
struct ClearFaults {
  MotorNames motors{};
};

// Gives the group another table from its next move on, as soon as its MCUs stand. A later request
// for the same group ends this one with kStopped.
struct UseTable {
  std::string group{};
  std::string table{};  // NAME, NAME@REVISION or NAME@TAG
};

// Reads all groups' tables again. Result kFault if the table of a group was bad and the old one
// stays.
struct ReloadTables {};

// Motors, at rest, look for their switches, those of one MCU one after the other.
struct Home {
  MotorNames motors{};           // at least one, each with `home` in the configuration
  std::optional<Speed> speed{};  // of the fast approach
  bool all = false;              // all motors with `home`, by its order; none is named then
};

// Motors, at rest, wait for an edge at the trigger input of their MCU and begin together after it.
struct Arm {
  Edge edge = Edge::kRising;
  std::int64_t delay_us = 0;          // 50..1650000, three ticks come on top
  std::vector<MotorAmount> motors{};  // by so much, not 0
  std::optional<Speed> speed{};
  // They wait no more as soon as the client has gone; its transport has to tell that.
  bool while_connected = false;
};

// Motors of one bus, at rest, wait for an edge at the trigger inputs of their MCUs and begin a line
// (MoveLine) after it, which the MCUs run by themselves: each must have the line's table. Each MCU
// begins by the edge at its own input; one that has it more than a tick later ends the line.
// Result: as of MoveLine.
struct ArmLine {
  Edge edge = Edge::kRising;
  std::int64_t delay_us = 0;  // as of Arm
  Move::Kind kind = Move::Kind::kRelative;
  std::vector<MotorAmount> motors{};   // as of MoveLine; each makes a step at least
  std::optional<Speed> speed{};        // as of MoveLine
  std::optional<double> duration_s{};  // as of MoveLine
  bool while_connected = false;        // as of Arm
};

// Motors that wait for the trigger do so no more, nor do those armed with them; none named: all.
struct Disarm {
  MotorNames motors{};
};

// The position compare output of the motor's MCU pulses when the motor arrives at the position.
struct PositionCompare {
  std::string motor{};
  Amount position{};
  Directions arrivals{};      // on the dial, by steps in these directions; none: no pulses any more
  std::int64_t delay_us = 0;  // from the step to the pulse, 0..1500000
  std::int64_t width_us = 0;  // of the pulse, 1..1000000; of no meaning without arrivals
};

// Result: TableList.
struct ListTables {};

// Result: tables::TableContent as its file says.
struct GetTable {
  std::string table{};  // NAME, NAME@REVISION or NAME@TAG
};

// A new revision of a table file, or a new one; puts nothing in service. A file that has the
// content already stays as it is. Result: TableList with the one as it is now.
struct SetTable {
  std::string table{};  // NAME
  tables::TableContent content{};
  // Of the table that this one was made from, as GetTable told it (its revision is in the content);
  // if the table is another by now it is left alone. "": the table is new.
  std::string expected_hash{};
};

// The positions of these motors, at rest, are right as their MCUs count them: they are known.
struct Confirm {
  MotorNames motors{};  // at least one
};

// What has moved a motor, the newest first. Refused without a state store. Result: MotionHistory.
struct GetHistory {
  std::string motor{};
  std::int32_t most = 20;  // 1..1000
};

// Keys of motors that may be changed in operation (config/setting.h). Their values are
// texts as in bushd.toml: 12.5, negative, [-5, 30]; without soft limits none. Result: Configuration
// of the motors that were named.
struct Configure {
  enum class Kind {
    kShow,
    kChange,  // of motors at rest; all of it or nothing
    kSaved    // bushd.toml says this now, and has file_sha256: the client has written it
  };
  struct Change {
    std::string motor{};
    std::string key{};
    std::string value{};
    friend bool operator==(const Change&, const Change&) = default;
  };
  Kind kind = Kind::kShow;
  MotorNames motors{};            // of kShow; none named: all
  std::vector<Change> changes{};  // of the others
  std::string file_sha256{};
};

// A motor moves on at a speed, up to its soft limit, for as long as its client keeps it going. The
// first request opens the motion and has its result, with one MotorResult, when that ends:
// kDone ended by its client, kLimit at the soft limit, kStopped otherwise. Further ones of the
// client change speed and direction, or just renew it, and are answered at once. Speed 0, of
// whatever client, ends it: result kDone once the motor stands.
struct Jog {
  static constexpr std::int64_t kLeastKeepaliveMs = 50;
  static constexpr std::int64_t kMostKeepaliveMs = 10'000;

  std::string motor{};
  double per_s = 0;       // signed
  bool in_steps = false;  // else in the motor's unit, on the user's scale
  // The motor is ramped down when no request of its client has come for so long.
  std::int64_t keepalive_ms = 500;
  // A sign of life: the client's jog of this motor goes on as it is. Speed and steps say nothing.
  bool renew = false;
  // With speed 0: not as soon as possible, but so many steps after where the motor is now.
  // 0..2^31-1
  std::optional<std::int64_t> steps_after{};
};

// These motors, or those of these groups, which move ramp down and keep their targets: their moves
// stay open. None named: all. Jogs end. Result kDone once they stand. Moves of other motors, homing
// and what waits for the trigger are left alone.
struct Pause {
  MotorNames motors{};  // and groups, as of the three below
};
// Those that are paused go on to their targets. Refused as a whole if one of them may not move.
struct Resume {
  MotorNames motors{};
};
// No motion of these motors begins, and none goes on that is paused, until they are released. What
// is under way goes on.
struct Hold {
  MotorNames motors{};
};
struct Release {
  MotorNames motors{};
};

// Cycles of a CAMAC crate of the configuration, at once. Result: CamacResult.
struct Camac {
  static constexpr std::uint32_t kMostCycles = 4096;  // also of words

  std::int32_t crate = 1;
  camac::Block block{};  // stations 1..31, subaddresses 0..15, functions 0..31, 24 bits of data
};

struct Request
    : std::variant<Move, Stop, EmergencyStop, Enable, Disable, SetPosition, ClearFaults, UseTable,
                   ReloadTables, Home, Arm, Disarm, PositionCompare, ListTables, GetTable, SetTable,
                   Confirm, GetHistory, Configure, Jog, Pause, Resume, Hold, Release, MoveLine,
                   Camac, MovePath, Follow, ArmLine> {
  using variant::variant;
  Request();
  Request(const Request&);
  Request(Request&&) noexcept;
  Request& operator=(const Request&);
  Request& operator=(Request&&) noexcept;
  ~Request();
};

// For logs and counts: "move", "stop", "emergency stop", ...
std::string_view name_of(const Request& request);

// Ends motion: a stop of whatever kind, a pause, a hold, a disarming, a jog's end. Taken before
// anything that waits, however much that is, and ends what has arrived before it and has not begun.
bool ends_motion(const Request& request);

// Carrying it out twice does what once does, so it needs no session: stops, and what only reads.
bool is_repeatable(const Request& request);

}  // namespace bushd::api
