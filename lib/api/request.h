// Everything that can be asked of the daemon: one type per request. A new request is a new type
// here, a service in the core and a message in the front ends; no other request changes. What ends
// motion, or is harmless when it is carried out twice, says so (below: ends_motion, is_repeatable).
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

#include "api/move_requests.h"
#include "api/table_file.h"
#include "api/words.h"
#include "base/fields.h"
#include "words/camac.h"

namespace bushd::api {

// Ramps these motors down; none named: all. Result kDone once they stand. Also disarms, and ends
// homing. Never refused, but for an unknown motor.
struct Stop {
  MotorNames motors{};

  static constexpr std::string_view kName = "stop";
  static constexpr bool ends_motion() { return true; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// Stops all motors of all buses as the configuration says (StopMode), and latches the stop in every
// MCU until ClearFaults. Never refused. Result kDone once all MCUs that are online stand.
struct EmergencyStop {
  static constexpr std::string_view kName = "emergency stop";
  static constexpr bool ends_motion() { return true; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
};

// Drivers of the MCUs of these motors on or off; none named: of all. Disable is refused while one
// of them moves.
struct Enable {
  MotorNames motors{};

  static constexpr std::string_view kName = "enable";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};
struct Disable {
  MotorNames motors{};

  static constexpr std::string_view kName = "disable";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// Says where these motors, at rest, stand. In user units, of a motor that has a unit: changes the
// offset, so that where it stands is this user position. Otherwise, and with `dial`: sets the
// position, which is known then.
struct SetPosition {
  std::vector<MotorAmount> motors{};  // at least one
  bool dial = false;                  // user units are those of the dial

  static constexpr std::string_view kName = "set position";
  static void fields(auto& self, auto& visit) {
    visit("dial", self.dial);
    names_fields(self, visit);
  }
};

// Clears latched faults of the MCUs of these motors, none named: of all. Refused while one moves.
struct ClearFaults {
  MotorNames motors{};

  static constexpr std::string_view kName = "clear faults";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// Gives the group another table from its next move on, as soon as its MCUs stand. A later request
// for the same group ends this one with kStopped.
struct UseTable {
  std::string group{};
  std::string table{};  // NAME, NAME@REVISION or NAME@TAG

  static constexpr std::string_view kName = "use table";
  static void fields(auto& self, auto& visit) {
    visit("group", self.group);
    visit("table", self.table);
  }
};

// Reads all groups' tables again. Result kFault if the table of a group was bad and the old one
// stays.
struct ReloadTables {
  static constexpr std::string_view kName = "reload tables";
  static void fields(auto& /*self*/, auto& /*visit*/) {}
};

// Motors, at rest, look for their switches, those of one MCU one after the other.
struct Home {
  MotorNames motors{};           // at least one, each with `home` in the configuration
  std::optional<Speed> speed{};  // of the fast approach
  bool all = false;              // all motors with `home`, by its order; none is named then

  static constexpr std::string_view kName = "home";
  static void fields(auto& self, auto& visit) {
    speed_fields(self.speed, visit);
    names_fields(self, visit);
    visit("all", self.all);
  }
};

// Motors, at rest, wait for an edge at the trigger input of their MCU and begin together after it.
struct Arm {
  Edge edge = Edge::kRising;
  std::int64_t delay_us = 0;          // 50..1650000, three ticks come on top
  std::vector<MotorAmount> motors{};  // by so much, not 0
  std::optional<Speed> speed{};
  // They wait no more as soon as the client has gone; its transport has to tell that.
  bool while_connected = false;

  static constexpr std::string_view kName = "arm";
  static void fields(auto& self, auto& visit) {
    visit("edge", self.edge, kEdge);
    visit("delay_us", self.delay_us);
    speed_fields(self.speed, visit);
    visit("while_connected", self.while_connected);
    names_fields(self, visit);
  }
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

  static constexpr std::string_view kName = "arm line";
  static void fields(auto& self, auto& visit) {
    visit("edge", self.edge, kEdge);
    visit("delay_us", self.delay_us);
    visit("kind", self.kind, Move::kKind);
    speed_fields(self.speed, visit);
    visit("duration_s", self.duration_s, kNoDuration);
    visit("while_connected", self.while_connected);
    names_fields(self, visit);
  }
};

// Motors that wait for the trigger do so no more, nor do those armed with them; none named: all.
struct Disarm {
  MotorNames motors{};

  static constexpr std::string_view kName = "disarm";
  static constexpr bool ends_motion() { return true; }
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// Directions as a sum of bits.
struct AsBits {
  static std::int8_t told(Directions directions) {
    return static_cast<std::int8_t>((directions.positive ? 1 : 0) | (directions.negative ? 2 : 0));
  }
  static bool taken(std::int8_t told, Directions& directions) {
    directions = {.positive = (told & 1) != 0, .negative = (told & 2) != 0};
    return (told & ~3) == 0;
  }
};

// The position compare output of the motor's MCU pulses when the motor arrives at the position.
struct PositionCompare {
  std::string motor{};
  Amount position{};
  Directions arrivals{};      // on the dial, by steps in these directions; none: no pulses any more
  std::int64_t delay_us = 0;  // from the step to the pulse, 0..1500000
  std::int64_t width_us = 0;  // of the pulse, 1..1000000; of no meaning without arrivals

  static constexpr std::string_view kName = "position compare";
  static void fields(auto& self, auto& visit) {
    MotorAmount position{self.motor, self.position};
    visit("position", position);
    visit.set(self.motor, position.motor);
    visit.set(self.position, position.amount);
    visit("arrivals", self.arrivals, AsBits{});
    visit("delay_us", self.delay_us);
    visit("width_us", self.width_us);
  }
};

// Result: TableList.
struct ListTables {
  static constexpr std::string_view kName = "list tables";
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
};

// Result: TableFile.
struct GetTable {
  std::string table{};  // NAME, NAME@REVISION or NAME@TAG

  static constexpr std::string_view kName = "get table";
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) { visit("table", self.table); }
};

// A new revision of a table file, or a new one; puts nothing in service. A file that has the
// content already stays as it is. Result: TableList with the one as it is now.
struct SetTable {
  std::string table{};  // NAME
  TableFile content{};  // its hash does not matter
  // The hash of the table that this one was made from, as GetTable told it (its revision is in the
  // content); if the table is another by now it is left alone. "": the table is new.
  std::string expected_hash{};

  static constexpr std::string_view kName = "set table";
  static void fields(auto& self, auto& visit) {
    visit("table", self.table);
    visit("expected_hash", self.expected_hash);
    visit("content", self.content);
  }
};

// The positions of these motors, at rest, are right as their MCUs count them: they are known.
struct Confirm {
  MotorNames motors{};  // at least one

  static constexpr std::string_view kName = "confirm";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// What has moved a motor, the newest first. Refused without a state store. Result: MotionHistory.
struct GetHistory {
  std::string motor{};
  std::int32_t most = 20;  // 1..1000

  static constexpr std::string_view kName = "get history";
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit("most", self.most);
  }
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
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit("key", self.key);
      visit("value", self.value);
    }
    friend bool operator==(const Change&, const Change&) = default;
  };
  Kind kind = Kind::kShow;
  MotorNames motors{};            // of kShow; none named: all
  std::vector<Change> changes{};  // of the others
  std::string file_sha256{};

  static constexpr std::string_view kName = "configure";
  bool is_repeatable() const { return kind == Kind::kShow; }
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, fields::OneOf<3>{});
    names_fields(self, visit);
    visit.list("change_count", "changes", self.changes);
    visit("file_sha256", self.file_sha256);
  }
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

  static constexpr std::string_view kName = "jog";
  bool ends_motion() const { return per_s == 0 && !renew; }
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit("speed", self.per_s);
    visit("speed_in_steps", self.in_steps);
    visit("keepalive_ms", self.keepalive_ms);
    visit("renew", self.renew);
    visit("steps_after", self.steps_after, fields::NoneIs<std::int64_t>{-1});
  }
};

// These motors, or those of these groups, which move ramp down and keep their targets: their moves
// stay open. None named: all. Jogs end. Result kDone once they stand. Moves of other motors, homing
// and what waits for the trigger are left alone.
struct Pause {
  MotorNames motors{};  // and groups, as of the three below

  static constexpr std::string_view kName = "pause";
  static constexpr bool ends_motion() { return true; }
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};
// Those that are paused go on to their targets. Refused as a whole if one of them may not move.
struct Resume {
  MotorNames motors{};

  static constexpr std::string_view kName = "resume";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};
// No motion of these motors begins, and none goes on that is paused, until they are released. What
// is under way goes on.
struct Hold {
  MotorNames motors{};

  static constexpr std::string_view kName = "hold";
  static constexpr bool ends_motion() { return true; }
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};
struct Release {
  MotorNames motors{};

  static constexpr std::string_view kName = "release";
  static void fields(auto& self, auto& visit) { names_fields(self, visit); }
};

// Cycles of a CAMAC crate of the configuration, at once. Result: CamacResult.
struct Camac {
  static constexpr std::uint32_t kMostCycles = 4096;  // also of words

  std::int32_t crate = 1;
  camac::Block block{};  // stations 1..31, subaddresses 0..15, functions 0..31, 24 bits of data

  static constexpr std::string_view kName = "camac";
  static void fields(auto& self, auto& visit) {
    visit("crate", self.crate);
    camac::Block::fields(self.block, visit);
  }
};

// A program for the MCU of its motors (docs/programs.md), in place of the one that this MCU has. It
// is checked as things are, then sent; nothing of it runs before it has arrived whole. Refused
// while a program of that MCU is under way. Result: ProgramList with this one.
struct PutProgram {
  static constexpr std::size_t kMostBytes = 56 * 1024;  // of all its texts: they are one message

  struct Points {
    std::string file{};  // as the text names it
    std::string text{};
    static void fields(auto& self, auto& visit) {
      visit("file", self.file);
      visit("text", self.text);
    }
    friend bool operator==(const Points&, const Points&) = default;
  };
  std::string program{};  // its name: 1 to 63 of A-Z a-z 0-9 _ . -, the first one no -
  std::string text{};     // TOML
  std::vector<Points> points{};
  bool dry_run = false;  // it is checked, and what it would do is told

  static constexpr std::string_view kName = "put program";
  static void fields(auto& self, auto& visit) {
    visit("program", self.program);
    visit("text", self.text);
    visit.list("file_count", "points", self.points);
    visit("dry_run", self.dry_run);
  }
};

// The program goes out of the memory of its MCU. Refused while it is under way.
struct EraseProgram {
  std::string program{};

  static constexpr std::string_view kName = "erase program";
  static void fields(auto& self, auto& visit) { visit("program", self.program); }
};

// These programs, of MCUs of one bus, begin with the same tick, or none does. Their motors are at
// rest. Stop, pause and resume of one of its motors are for the whole program. Result: as of Move;
// the reason names the frame at which each has ended.
struct RunPrograms {
  std::vector<std::string> programs{};  // at least one, none twice

  static constexpr std::string_view kName = "run programs";
  static void fields(auto& self, auto& visit) {
    visit.list("program_count", "programs", self.programs);
  }
};

// Result: ProgramList of all MCUs that can have one.
struct ListPrograms {
  static constexpr std::string_view kName = "list programs";
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
};

struct Request : std::variant<Move, Stop, EmergencyStop, Enable, Disable, SetPosition, ClearFaults,
                              UseTable, ReloadTables, Home, Arm, Disarm, PositionCompare,
                              ListTables, GetTable, SetTable, Confirm, GetHistory, Configure, Jog,
                              Pause, Resume, Hold, Release, MoveLine, Camac, MovePath, Follow,
                              ArmLine, PutProgram, EraseProgram, RunPrograms, ListPrograms> {
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
