// What clients ask of the daemon, in bushfaults' own words: clients make it, the witness remembers
// it, and request.cpp alone knows what the daemon takes in its place.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/lcm_shim.h"

namespace bushfaults {

// The numbers are those of the daemon's message, so that nonsense can be any other one.
enum class Ask : std::int8_t {
  kMoveBy = 1,
  kMoveTo = 2,
  kStop = 3,
  kEnable = 4,
  kDisable = 5,
  kSetPosition = 6,
  kClearFaults = 7,
  kEmergencyStop = 8,
  kHome = 11,
  kArm = 13,
  kDisarm = 14,
};

struct Request {
  std::string client;
  std::int64_t number = 0;
  Ask ask{};
  std::vector<std::string> motors{};
  std::vector<std::int64_t> steps{};
  bool rising = false;        // kArm: the edge
  std::int32_t delay_us = 0;  // kArm

  void add(const std::string& motor, std::int64_t steps_of_it) {
    motors.push_back(motor);
    steps.push_back(steps_of_it);
  }
  // Of motors that then have a part in it, each with a result of its own.
  bool is_move() const { return ask == Ask::kMoveBy || ask == Ask::kMoveTo || ask == Ask::kArm; }
  // Twice is not the same as once.
  bool counts_once() const { return is_move() || ask == Ask::kHome || ask == Ask::kSetPosition; }
  // For other motors' homing, or the trigger: nobody knows for how long.
  bool may_wait() const { return ask == Ask::kHome || ask == Ask::kArm; }
};

// To the daemon. Replies may come before it returns.
void give(bushd::daemon::LcmShim& daemon, std::int64_t now_us, const Request& request);
std::string text_of(const Request& request);

}  // namespace bushfaults
