// What clients ask of the daemon, in bushfaults' own words: clients make it, the witness remembers
// it, and request.cpp alone knows the type of lib/api that it is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "api/request.h"
#include "lcm/codec.h"
#include "mcu_program.h"

namespace bushfaults {

// User units are asked for in millionths.
inline constexpr std::int64_t kMicro = 1'000'000;

enum class Ask : std::uint8_t {
  kMoveBy,
  kMoveTo,
  kStop,
  kEnable,
  kDisable,
  kSetPosition,
  kClearFaults,
  kEmergencyStop,
  kHome,
  kArm,
  kDisarm,
  kConfirm,
  kJog,
  kPause,
  kResume,
  kHold,
  kRelease,
  kConfigure,
  kCamac,
  kRows,  // of a trajectory, or points of a path that others follow
  kPutProgram,
  kEraseProgram,
  kRunPrograms,  // its motors are those of the programs
};

// What a motor may be given in operation. Numbers are millionths of its unit.
struct Setting {
  enum class Key : std::uint8_t { kOffset, kDirection, kSoftLimits };
  Key key{};
  std::int64_t low = 0;  // the offset; the lower limit; below 0: the direction is negative
  std::int64_t high = 0;
  bool none = false;  // no soft limits
};

// What the network makes of a message that is to be dropped.
enum class Damage : std::uint8_t { kNone, kOtherType, kTruncated, kTooLong, kOtherChannel };

struct Request {
  std::string client;
  std::int64_t session = 0;
  std::int64_t number = 0;
  std::int64_t sent_us = 0;  // for the first time
  bool unordered = false;    // its session does not know of it, and not its place among others
  Ask ask{};
  std::vector<std::string> motors{};
  std::vector<std::int64_t> steps{};   // as many as motors
  bool user = false;                   // they are millionths of each motor's unit
  bool line = false;                   // kMoveBy, kMoveTo, kArm: all on one way
  bool elementary = false;             // a line: by that law
  std::vector<std::int64_t> points{};  // of a path, or a trajectory, row by row, in millionths
  std::vector<double> point_speeds{};  // of a path of one motor: to each point
  bool exact = false;                  // a path: with a rest at each point
  // The rows that this part of a path tells, all of whose parts know all points; 0: to the last.
  std::size_t first_row = 0;
  std::size_t end_row = 0;
  std::int64_t trajectory = 0;           // its number; kMoveTo: to be followed
  std::vector<std::int64_t> times_ms{};  // kRows: of each row
  bool cubic = false;                    // a trajectory
  bool last_rows = false;                // kRows
  bool dial = false;                     // kSetPosition: on the dial
  std::int64_t speed_micro = 0;          // of moves and jogs, millionths a second; 0: none
  bool speed_in_steps = false;
  std::int64_t keepalive_ms = 0;              // kJog
  bool renew = false;                         // kJog
  std::optional<std::int64_t> steps_after{};  // kJog, with speed 0
  std::vector<Setting> settings{};            // kConfigure: as many as motors
  bool rising = false;                        // kArm: the edge
  std::int32_t delay_us = 0;                  // kArm
  std::vector<bushd::camac::Naf> cycles{};    // kCamac
  bushd::camac::BlockMode block_mode = bushd::camac::BlockMode::kSingle;
  std::uint32_t words = 0;              // of the other modes
  int last_station = 23;                // of a scan
  bool unknown_way = false;             // a move, and nobody knows by how many steps
  McuProgram program{};                 // kPutProgram
  std::vector<std::string> programs{};  // kEraseProgram, kRunPrograms: their names
  Damage damage = Damage::kNone;

  void add(const std::string& motor, std::int64_t steps_of_it) {
    motors.push_back(motor);
    steps.push_back(steps_of_it);
  }
  bushd::lcm::RequestId id() const { return {session, client, number}; }
  bool is_stop() const { return ask == Ask::kStop || ask == Ask::kEmergencyStop; }
  // As api::ends_motion.
  bool ends_motion() const {
    return is_stop() || ask == Ask::kPause || ask == Ask::kHold || ask == Ask::kDisarm ||
           (ask == Ask::kJog && speed_micro == 0 && !renew);
  }
  // The motors then have a part in it, each with a result of its own.
  bool is_move() const { return ask == Ask::kMoveBy || ask == Ask::kMoveTo || ask == Ask::kArm; }
  bool names(const std::string& motor) const {
    return std::find(motors.begin(), motors.end(), motor) != motors.end();
  }
  bool names_or_all(const std::string& motor) const { return motors.empty() || names(motor); }
  // For other motors' homing, or the trigger; or in repeats without end: nobody knows for how long.
  bool may_wait() const {
    return ask == Ask::kHome || ask == Ask::kArm || ask == Ask::kRunPrograms;
  }
};

// The same as an lcm::RequestId, in an order.
using Key = std::tuple<std::int64_t, std::string, std::int64_t>;
inline Key key_of(const bushd::lcm::RequestId& id) {
  return {id.session, id.client_id, id.number};
}

bushd::api::Request api_of(const Request& request);
// As it arrives at the daemon.
bushd::lcm::Packet packet_of(const Request& request);
std::string text_of(const Request& request);
std::string text_of(const Key& key, const bushd::api::Reply& reply);
std::string text_of(const bushd::lcm::ReplyMessage& message);

}  // namespace bushfaults
