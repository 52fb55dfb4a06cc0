#include "request.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "bushd/command_t.hpp"

namespace bushfaults {

using bushd::command_t;

static_assert(static_cast<int>(Ask::kMoveBy) == command_t::MOVE_RELATIVE);
static_assert(static_cast<int>(Ask::kMoveTo) == command_t::MOVE_ABSOLUTE);
static_assert(static_cast<int>(Ask::kStop) == command_t::STOP);
static_assert(static_cast<int>(Ask::kEnable) == command_t::ENABLE);
static_assert(static_cast<int>(Ask::kDisable) == command_t::DISABLE);
static_assert(static_cast<int>(Ask::kSetPosition) == command_t::SET_POSITION);
static_assert(static_cast<int>(Ask::kClearFaults) == command_t::CLEAR_FAULTS);
static_assert(static_cast<int>(Ask::kEmergencyStop) == command_t::EMERGENCY_STOP);
static_assert(static_cast<int>(Ask::kHome) == command_t::HOME);
static_assert(static_cast<int>(Ask::kArm) == command_t::ARM);
static_assert(static_cast<int>(Ask::kDisarm) == command_t::DISARM);

void give(bushd::daemon::LcmShim& daemon, std::int64_t now_us, const Request& request) {
  command_t command{};
  command.client_id = request.client;
  command.number = request.number;
  command.kind = static_cast<std::int8_t>(request.ask);
  command.motors = request.motors;
  command.motor_count = static_cast<std::int32_t>(request.motors.size());
  command.steps = request.steps;
  if (request.ask == Ask::kArm) {
    command.edge = request.rising ? command_t::RISING : command_t::FALLING;
    command.delay_us = request.delay_us;
  }
  daemon.command(now_us, command);
}

std::string text_of(const Request& request) {
  const auto word = [&] {
    switch (request.ask) {
      case Ask::kMoveBy:
        return "move by";
      case Ask::kMoveTo:
        return "move to";
      case Ask::kStop:
        return "stop";
      case Ask::kEnable:
        return "enable";
      case Ask::kDisable:
        return "disable";
      case Ask::kSetPosition:
        return "set position";
      case Ask::kClearFaults:
        return "clear faults";
      case Ask::kEmergencyStop:
        return "emergency stop";
      case Ask::kHome:
        return "home";
      case Ask::kArm:
        return request.rising ? "arm (rising)" : "arm (falling)";
      case Ask::kDisarm:
        return "disarm";
    }
    return "?";
  };
  return fmt::format("{} #{}: {} {} {}", request.client.substr(0, 16), request.number, word(),
                     fmt::join(request.motors, ","), fmt::join(request.steps, ","));
}

}  // namespace bushfaults
