// The words after `bushctl move`, `arm`, `compare` and `set`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/request.h"
#include "base/result.h"

namespace bushctl {

// What the numbers are: in the motors' units, of motors without one in steps; or all in steps.
enum class Numbers { kUser, kSteps };

// "2.5": not to be exceeded, per second. "" is none.
bushd::Result<std::optional<bushd::api::Speed>> parse_speed(const std::string& word,
                                                            Numbers numbers);

// "theta 400 chi -20" moves by so much, "theta --to 400 chi --to -20" to these positions; in any
// case all motors as one group. A mixture is refused: one command is relative or absolute.
bushd::Result<bushd::api::Move> parse_move(const std::vector<std::string>& words, Numbers numbers);

// How motors move along a straight line.
struct LineOptions {
  std::string duration{};  // in seconds, "" is none
  std::string law = "leading";
  std::string feed{};  // "2.5", per second, "" is none
};
inline const std::vector<std::string> kLaws{"leading", "elementary"};
bushd::Result<bushd::api::MoveLine> parse_move_line(const std::vector<std::string>& words,
                                                    Numbers numbers, const LineOptions& options);

// "2.5": along the way of several motors, per second. "" is none.
bushd::Result<std::optional<bushd::api::Speed>> parse_feed(const std::string& word,
                                                           Numbers numbers);

// "theta 400 chi -20": the same by so much, when the trigger comes.
bushd::Result<bushd::api::Arm> parse_arm(const std::vector<std::string>& words, Numbers numbers,
                                         const std::string& edge, std::int64_t delay_us);

// "theta 400 chi -20", also with --to: along a straight line, when the trigger comes.
bushd::Result<bushd::api::ArmLine> parse_arm_line(const std::vector<std::string>& words,
                                                  Numbers numbers, const std::string& edge,
                                                  std::int64_t delay_us,
                                                  const std::string& duration);

struct Pulse {
  std::string direction = "both";  // or "positive", "negative"
  std::int64_t delay_us = 0;
  std::int64_t width_us = 10;
};
// "theta", "400": a pulse when theta arrives at 400; "theta", "off": none.
bushd::Result<bushd::api::PositionCompare> parse_position_compare(const std::string& motor,
                                                                  const std::string& where,
                                                                  Numbers numbers,
                                                                  const Pulse& pulse);

// "theta", "400": theta stands at 400.
bushd::Result<bushd::api::SetPosition> parse_set(const std::string& motor, const std::string& word,
                                                 Numbers numbers, bool dial);

}  // namespace bushctl
