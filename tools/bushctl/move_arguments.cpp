#include "move_arguments.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <optional>

namespace bushctl {
namespace {

using bushd::command_t;
using bushd::fail;
using bushd::Result;

constexpr const char* kMoveUsage =
    "write NAME STEPS [NAME STEPS...] or NAME --to STEPS [NAME --to STEPS...]";

std::optional<std::int64_t> whole_number(const std::string& word) {
  std::int64_t value = 0;
  // from_chars knows no leading plus.
  const char* begin = word.data() + (word.size() > 1 && word[0] == '+' && word[1] != '-' ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

Result<std::int64_t> steps_of(const std::string& motor, const std::string& word) {
  if (const auto value = whole_number(word)) return *value;
  return fail(
      fmt::format("{}: \"{}\" is not a whole number of steps; {}", motor, word, kMoveUsage));
}

}  // namespace

Result<command_t> parse_move(const std::vector<std::string>& words) {
  command_t command{};
  for (std::size_t i = 0; i < words.size();) {
    const std::string& motor = words[i++];
    if (motor.starts_with("--")) {
      return fail(fmt::format("\"{}\" stands where a motor's name should; {}", motor, kMoveUsage));
    }
    if (i == words.size()) {
      return fail(fmt::format("{}: the number of steps is missing; {}", motor, kMoveUsage));
    }
    std::string number = words[i++];
    const bool absolute = number == "--to" || number.starts_with("--to=");
    if (number == "--to") {
      if (i == words.size()) return fail(motor + ": --to wants the position in steps after it");
      number = words[i++];
    } else if (absolute) {
      number.erase(0, std::string("--to=").size());
    }
    const auto steps = steps_of(motor, number);
    if (!steps) return fail(steps.error());
    const std::int8_t kind = absolute ? command_t::MOVE_ABSOLUTE : command_t::MOVE_RELATIVE;
    if (command.kind != 0 && command.kind != kind) {
      return fail(fmt::format(
          "{} is moved {}, the motors before it {}: one command is either. Give --to to "
          "all or to none, or send two commands",
          motor, absolute ? "to a position" : "by steps", absolute ? "by steps" : "to positions"));
    }
    command.kind = kind;
    command.motors.push_back(motor);
    command.steps.push_back(*steps);
  }
  if (command.motors.empty()) return fail(fmt::format("no motor is named; {}", kMoveUsage));
  return command;
}

Result<command_t> parse_arm(const std::vector<std::string>& words, const std::string& edge,
                            std::int32_t delay_us) {
  auto command = parse_move(words);
  if (!command) return command;
  if (command->kind != command_t::MOVE_RELATIVE) {
    return fail("--to: what waits for the trigger is moved by steps; write NAME STEPS");
  }
  command->kind = command_t::ARM;
  command->edge = edge == "falling" ? command_t::FALLING : command_t::RISING;
  command->delay_us = delay_us;
  return command;
}

Result<command_t> parse_reference(const std::string& motor, const std::string& where,
                                  const Pulse& pulse) {
  command_t command{};
  command.kind = command_t::REFERENCE;
  command.motors.push_back(motor);
  command.steps.push_back(0);
  if (where == "off") return command;
  const auto position_steps = whole_number(where);
  if (!position_steps) {
    return fail(fmt::format("{}: \"{}\" is neither a whole number of steps nor off", motor, where));
  }
  command.steps.front() = *position_steps;
  if (pulse.direction != "negative") command.arrivals |= command_t::POSITIVE;
  if (pulse.direction != "positive") command.arrivals |= command_t::NEGATIVE;
  command.delay_us = pulse.delay_us;
  command.width_us = pulse.width_us;
  return command;
}

Result<command_t> parse_set(const std::string& motor, const std::string& steps) {
  const auto position_steps = whole_number(steps);
  if (!position_steps) {
    return fail(fmt::format("{}: \"{}\" is not a whole number of steps", motor, steps));
  }
  command_t command{};
  command.kind = command_t::SET_POSITION;
  command.motors.push_back(motor);
  command.steps.push_back(*position_steps);
  return command;
}

}  // namespace bushctl
