// Everything that can be asked of the daemon: one type per request. A new request is a new type,
// its place in the variant below and a service in the core; no other request changes. Each says
// what it does to motion (api/words.h: Motion); what is harmless when it is carried out twice, and
// what names groups beside motors, says so (is_repeatable, kNamesGroups).
//
// Motors and groups are named as in the configuration. Front ends pass names and numbers as they
// come, however wrong: the core resolves them, checks every range and refuses with a reason. So the
// ranges that fields declare are those that are accepted, not preconditions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "api/move_requests.h"
#include "api/table_requests.h"
#include "api/words.h"
#include "base/fields.h"
#include "base/units/coordinates.h"
#include "words/camac.h"

namespace bushd::api {

struct Stop {
  MotorNames motors{};

  static constexpr std::string_view kName = "stop";
  static constexpr std::string_view kMeaning =
      "Ramps these motors down. Also disarms, and ends homing. Never refused, but for unknown "
      "motors.";
  static constexpr std::string_view kResult =
      "done, once they stand; fault where a name is unknown, link where an MCU is not online";
  static constexpr Motion motion() { return Motion::kEndsOnLines; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Stop&, const Stop&) = default;
};

struct EmergencyStop {
  static constexpr std::string_view kName = "emergency stop";
  static constexpr std::string_view kMeaning =
      "Stops all motors of all buses at once, as the configuration says; latched in every MCU "
      "until clear_faults_t. Never refused.";
  static constexpr std::string_view kResult =
      "done, once all MCUs that are online have latched the stop and stand; the reason names the "
      "others";
  static constexpr Motion motion() { return Motion::kEnds; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
  friend bool operator==(const EmergencyStop&, const EmergencyStop&) = default;
};

struct Enable {
  MotorNames motors{};

  static constexpr std::string_view kName = "enable";
  static constexpr std::string_view kMeaning = "Enables the drivers of the MCUs of these motors.";
  static constexpr std::string_view kResult =
      "done; of all: where an MCU is online, the reason names the others. Of some motors of an MCU "
      "the reason names its other ones";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Enable&, const Enable&) = default;
};

struct Disable {
  MotorNames motors{};

  static constexpr std::string_view kName = "disable";
  static constexpr std::string_view kMeaning =
      "Disables the drivers of the MCUs of these motors. Refused while one of them moves.";
  static constexpr std::string_view kResult = "as for enable_t";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Disable&, const Disable&) = default;
};

struct SetPosition {
  std::vector<MotorAmount> motors{};
  bool dial = false;

  static constexpr std::string_view kName = "set position";
  static constexpr std::string_view kMeaning =
      "Says where these motors, at rest, stand. In user units, of a motor that has a unit: changes "
      "the offset, so that where it stands is this user position. Otherwise, and with `dial`: sets "
      "the position, which is known then.";
  static constexpr std::string_view kResult = "done; a position that was set is known";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    visit({"dial", "user units are those of the dial"}, self.dial);
    names_fields(self, visit, "motors", kOneMotorOrMore);
  }
  friend bool operator==(const SetPosition&, const SetPosition&) = default;
};

struct ClearFaults {
  MotorNames motors{};

  static constexpr std::string_view kName = "clear faults";
  static constexpr std::string_view kMeaning =
      "Clears latched faults of the MCUs of these motors. Refused while one moves.";
  static constexpr std::string_view kResult = "as for enable_t";
  static constexpr Motion motion() { return Motion::kLiftsEmergencyStop; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const ClearFaults&, const ClearFaults&) = default;
};

struct Home {
  MotorNames motors{};
  std::optional<Speed> speed{};
  bool all = false;

  static constexpr std::string_view kName = "home";
  static constexpr std::string_view kMeaning =
      "Motors, at rest, look for their switches, those of one MCU one after the other.";
  static constexpr std::string_view kResult =
      "reached: found their switches, and moved on where `home` has a `then`; their trust is known";
  static constexpr Motion motion() { return Motion::kBegins; }
  static void fields(auto& self, auto& visit) {
    speed_fields(self.speed, visit,
                 "of the fast approach; 0: as fast as table and max_speed allow");
    names_fields(self, visit, {"motors", "each with `home` in the configuration"},
                 {"motor_count", "at least 1, unless `all`"});
    visit(
        {"all", "all motors with a home switch, in the order of their `home`; none is named then"},
        self.all);
  }
  friend bool operator==(const Home&, const Home&) = default;
};

inline constexpr fields::Field kWhileConnected{
    "while_connected", "disarmed as soon as the client has gone; control socket only"};

struct Arm {
  static constexpr fields::Range<std::int64_t> kDelayUs{50, 1'650'000};
  static constexpr fields::Field kDelay{"delay_us", "after the edge; three ticks come on top",
                                        kDelayUs};

  Edge edge = Edge::kRising;
  std::int64_t delay_us = 0;
  std::vector<MotorAmount> motors{};
  std::optional<Speed> speed{};
  bool while_connected = false;

  static constexpr std::string_view kName = "arm";
  static constexpr std::string_view kMeaning =
      "Motors, at rest, wait for an edge at the trigger input of their MCU; those of one MCU begin "
      "together after it.";
  static constexpr std::string_view kResult = "reached, after the trigger has come";
  static constexpr Motion motion() { return Motion::kBegins; }
  static void fields(auto& self, auto& visit) {
    visit("edge", self.edge, kEdge);
    visit(kDelay, self.delay_us);
    speed_fields(self.speed, visit);
    visit(kWhileConnected, self.while_connected);
    names_fields(self, visit, {"motors", "by so much, not 0"}, kOneMotorOrMore);
  }
  friend bool operator==(const Arm&, const Arm&) = default;
};

struct ArmLine {
  Edge edge = Edge::kRising;
  std::int64_t delay_us = 0;
  Move::Kind kind = Move::Kind::kRelative;
  std::vector<MotorAmount> motors{};
  std::optional<Speed> speed{};
  std::optional<double> duration_s{};
  bool while_connected = false;

  static constexpr std::string_view kName = "arm line";
  static constexpr std::string_view kMeaning =
      "Motors of one bus, at rest, wait for an edge at the trigger inputs of their MCUs and begin "
      "a line (move_line_t) after it, which the MCUs run by themselves: each must have the line's "
      "table. Each MCU begins by the edge at its own input; one that has it more than a tick later "
      "ends the line.";
  static constexpr std::string_view kResult = "reached, after the trigger has come";
  static constexpr Motion motion() { return Motion::kBegins; }
  static void fields(auto& self, auto& visit) {
    visit("edge", self.edge, kEdge);
    visit(Arm::kDelay, self.delay_us);
    visit("kind", self.kind, Move::kKind);
    speed_fields(self.speed, visit);
    visit(kDuration, self.duration_s, kNoDuration);
    visit(kWhileConnected, self.while_connected);
    names_fields(self, visit, {"motors", "each makes a step at least"}, MoveLine::kMotorCount);
  }
  friend bool operator==(const ArmLine&, const ArmLine&) = default;
};

struct Disarm {
  MotorNames motors{};

  static constexpr std::string_view kName = "disarm";
  static constexpr std::string_view kMeaning =
      "These motors, and all that were armed with them, wait for the trigger no more.";
  static constexpr std::string_view kResult = "done, when they no longer wait";
  static constexpr Motion motion() { return Motion::kEnds; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Disarm&, const Disarm&) = default;
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
  static std::array<std::pair<int, fields::Constant>, 2> constants() {
    return {{{1, {"POSITIVE"}}, {2, {"NEGATIVE"}}}};
  }
};

struct PositionCompare {
  static constexpr fields::Range<std::int64_t> kDelayUs{0, 1'500'000};
  static constexpr fields::Range<std::int64_t> kWidthUs{1, 1'000'000};

  std::string motor{};
  Amount position{};
  Directions arrivals{};
  std::int64_t delay_us = 0;
  std::int64_t width_us = 0;

  static constexpr std::string_view kName = "position compare";
  static constexpr std::string_view kMeaning =
      "The position compare output of the motor's MCU pulses when the motor arrives at the "
      "position.";
  static constexpr std::string_view kResult = "done";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    MotorAmount position{self.motor, self.position};
    visit("position", position);
    visit.set(self.motor, position.motor);
    visit.set(self.position, position.amount);
    visit({"arrivals",
           "on the dial, by steps in these directions, or their sum; 0: no pulses any more"},
          self.arrivals, AsBits{});
    visit({"delay_us", "from the step to the pulse", kDelayUs}, self.delay_us);
    visit({"width_us", "of the pulse; of no meaning without arrivals", kWidthUs}, self.width_us);
  }
  friend bool operator==(const PositionCompare&, const PositionCompare&) = default;
};

struct Confirm {
  MotorNames motors{};

  static constexpr std::string_view kName = "confirm";
  static constexpr std::string_view kMeaning =
      "The positions of these motors, at rest, are right as their MCUs count them: they are known.";
  static constexpr std::string_view kResult = "done; their positions are known";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    names_fields(self, visit, "motors", {"motor_count", "at least 1"});
  }
  friend bool operator==(const Confirm&, const Confirm&) = default;
};

struct GetHistory {
  static constexpr fields::Range<std::int32_t> kMost{1, 1000};

  std::string motor{};
  std::int32_t most = 20;

  static constexpr std::string_view kName = "get history";
  static constexpr std::string_view kMeaning =
      "What has moved a motor. Refused without a state store. Answered by history_answer_t.";
  static constexpr Motion motion() { return Motion::kNone; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit({"most", "motions, the newest", kMost}, self.most);
  }
  friend bool operator==(const GetHistory&, const GetHistory&) = default;
};

struct Configure {
  enum class Kind { kShow, kChange, kSaved };
  struct Change {
    std::string motor{};
    std::string key{};
    std::string value{};

    static constexpr std::string_view kName = "motor change";
    static constexpr std::string_view kMeaning = "Another value for a key of a motor.";
    static void fields(auto& self, auto& visit) {
      visit("motor", self.motor);
      visit("key", self.key);
      visit({"value",
             "as in bushd.toml, without quotes: 12.5, negative, [-5, 30]; none: no soft limits"},
            self.value);
    }
    friend bool operator==(const Change&, const Change&) = default;
  };
  Kind kind = Kind::kShow;
  MotorNames motors{};
  std::vector<Change> changes{};
  std::string file_sha256{};

  static constexpr fields::OneOf kKind{
      {{"SHOW", "needs no session"},
       {"CHANGE", "of motors at rest; all of it or nothing"},
       {"SAVED", "the client has written these values into bushd.toml"}}};
  static constexpr std::string_view kName = "configure";
  static constexpr std::string_view kMeaning =
      "Settings of motors that may be changed in operation (docs/configuration.md): tells them, or "
      "changes them. Answered by configuration_answer_t with the motors that were named.";
  static constexpr std::string_view kResult =
      "done, once the disk has it; the reason says which motor stands beyond its limits";
  static constexpr Motion motion() { return Motion::kNone; }
  bool is_repeatable() const { return kind == Kind::kShow; }
  static void fields(auto& self, auto& visit) {
    visit("kind", self.kind, kKind);
    names_fields(self, visit, {"motors", "of SHOW; none: all"});
    visit.list("change_count", {"changes", "of CHANGE and SAVED"}, self.changes);
    visit({"file_sha256", "of SAVED: of bushd.toml as it is now"}, self.file_sha256);
  }
  friend bool operator==(const Configure&, const Configure&) = default;
};

struct Jog {
  static constexpr fields::Range<std::int64_t> kKeepaliveMs{50, 10'000};
  static constexpr fields::Range<std::int64_t> kStepsAfter{0, units::Coordinates::kMaxSteps};
  static constexpr fields::NoneIs<std::int64_t> kNoSteps{-1};

  std::string motor{};
  double per_s = 0;
  bool in_steps = false;
  std::int64_t keepalive_ms = 500;
  bool renew = false;
  std::optional<std::int64_t> steps_after{};

  static constexpr std::string_view kName = "jog";
  static constexpr std::string_view kMeaning =
      "A motor moves on at a speed, up to its soft limit, for as long as its client keeps it "
      "going. The first request opens the motion and has its result when that ends. Further ones "
      "of the client change speed and direction, or just renew it, and are answered at once. Speed "
      "0, of whatever client and without a session, ends it.";
  static constexpr std::string_view kResult =
      "when the jog ends: done by its client, limit at the soft limit, else stopped; of further "
      "requests and renewals at once";
  constexpr Motion motion() const {
    if (renew) return Motion::kNone;
    return per_s == 0 ? Motion::kEnds : Motion::kBegins;
  }
  static void fields(auto& self, auto& visit) {
    visit("motor", self.motor);
    visit({"speed", kMotorUnitPerS, "signed, on the user's scale; 0 ends the jog"}, self.per_s);
    visit({"speed_in_steps", "the speed is in steps/s"}, self.in_steps);
    visit({"keepalive_ms", "ramped down when no request of the client has come for so long",
           kKeepaliveMs},
          self.keepalive_ms);
    visit({"renew",
           "a sign of life: the client's jog of this motor goes on as it is; speed and "
           "steps_after say nothing"},
          self.renew);
    visit({"steps_after", fields::Unit{"steps"},
           "with speed 0: ends so many steps after where the motor is now; -1: as soon as possible",
           fields::Range{kNoSteps.none, kStepsAfter.most}},
          self.steps_after, kNoSteps);
  }
  friend bool operator==(const Jog&, const Jog&) = default;
};

struct Pause {
  MotorNames motors{};

  static constexpr std::string_view kName = "pause";
  static constexpr std::string_view kMeaning =
      "These motors, as far as they move, ramp down and keep their targets: their moves stay open. "
      "Jogs end. Moves of other motors, homing and what waits for the trigger are left alone.";
  static constexpr std::string_view kResult = "done, once they stand";
  static constexpr bool kNamesGroups = true;
  static constexpr Motion motion() { return Motion::kEndsOnLines; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Pause&, const Pause&) = default;
};

struct Resume {
  MotorNames motors{};

  static constexpr std::string_view kName = "resume";
  static constexpr std::string_view kMeaning =
      "Motors that are paused go on to their targets. Refused as a whole if one of them may not "
      "move.";
  static constexpr std::string_view kResult = "done";
  static constexpr bool kNamesGroups = true;
  static constexpr Motion motion() { return Motion::kBegins; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Resume&, const Resume&) = default;
};

struct Hold {
  MotorNames motors{};

  static constexpr std::string_view kName = "hold";
  static constexpr std::string_view kMeaning =
      "No motion of these motors begins, and none that is paused goes on, until they are released. "
      "What is under way goes on.";
  static constexpr std::string_view kResult = "done";
  static constexpr bool kNamesGroups = true;
  static constexpr Motion motion() { return Motion::kEnds; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Hold&, const Hold&) = default;
};

struct Release {
  MotorNames motors{};

  static constexpr std::string_view kName = "release";
  static constexpr std::string_view kMeaning = "Motors that are held may move again.";
  static constexpr std::string_view kResult = "done";
  static constexpr bool kNamesGroups = true;
  static constexpr Motion motion() { return Motion::kLiftsHold; }
  static void fields(auto& self, auto& visit) { names_or_all_fields(self, visit); }
  friend bool operator==(const Release&, const Release&) = default;
};

struct Camac {
  std::int32_t crate = 1;
  camac::Block block{};

  static constexpr std::string_view kName = "camac";
  static constexpr std::string_view kMessage = "camac request";
  static constexpr std::string_view kMeaning =
      "Cycles of a CAMAC crate of the configuration, at once. Answered by camac_reply_t.";
  static constexpr std::string_view kResult =
      "done, at once, with X, Q and data of each cycle; what the motors do is told by the modules";
  static constexpr Motion motion() { return Motion::kBeginsByService; }
  static void fields(auto& self, auto& visit) {
    visit("crate", self.crate);
    camac::Block::fields(self.block, visit);
  }
  friend bool operator==(const Camac&, const Camac&) = default;
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
