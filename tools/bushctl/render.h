// The state as people and programs read it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "client/status.h"

namespace bushctl {

// Lines of a table of all motors, then of all MCUs.
std::vector<std::string> table(const bushd::client::Status& status);

// One line with a remedy: that so many MCUs or buses of a status did not arrive, whether bushd has
// answered or not; that so many messages were lost since the status before.
std::string missing_text(bool answered, const bushd::client::Status::Missing& missing,
                         const char* things);
std::string lost_text(std::uint64_t messages);

// One line of the motor at this place in the state of the MCU at that place: name, position,
// target, velocity, moving or at rest, trust when it is not "known".
std::string motor_line(const bushd::client::Status& status, std::size_t mcu, std::size_t motor);

// The way of the same motor: "at 5.3 of 12.5 mm".
std::string way_text(const bushd::client::Status& status, std::size_t mcu, std::size_t motor);

// Where the same motor stands: "5.3 mm, 0.25 mm/s", "5.3 mm, at rest". And what bounds it:
// "uncertain | limit positive | -5 .. 25".
std::string stand_text(const bushd::client::Status& status, std::size_t mcu, std::size_t motor);
std::string bounds_text(const bushd::client::Status& status, std::size_t mcu, std::size_t motor);

// What a move would be, motor by motor and as a whole.
std::string json(const bushd::api::MovePlan& plan);
std::vector<std::string> lines(const bushd::api::MovePlan& plan);

// A reply in one line per motor, or in one line where no motors are named. Nothing of Refused,
// which is for stderr.
std::vector<std::string> lines(const bushd::api::Reply& reply);

// A line for each motor that reached a position which is not quite the one that it was sent to,
// since there is no step: "theta: at 12.3448 mm, asked 12.345".
std::vector<std::string> rounding_lines(const bushd::api::Request& request,
                                        const bushd::api::Reply& reply);

}  // namespace bushctl
