// A program as a person writes it: frames for motors of one MCU, in a TOML file.
//
//     motors = ["theta", "x"]        # of one MCU; the order of numbers below
//     without_host = false           # true: it goes on when no host is heard
//     kept = false                   # true: it outlives power cuts
//     at_power_on = false            # true: and begins by itself when the power comes
//     range = { theta = [-5, 5] }    # then: how far each may come from where it is then
//     unit = "user"                  # of positions: "user", or "steps"
//
//     [[frame]]
//     move_to = [10.5, -2]           # or { x = -2 }: one of them
//     speed = 3                      # user units or steps per s: none of them is faster
//     [[frame]]
//     repeat = 3                     # the frames until next; 0: without end
//     [[frame]]
//     line_by = [[1, 0], [0, 1]]     # points; or a file of columns: line_to = "points.csv"
//     law = "elementary"             # one motor makes one step at a time; left out: "leading"
//     feed = 2                       # of that law: along the way, in place of speed or beside it
//     [[frame]]
//     pulse_us = 50                  # at the position compare output
//     [[frame]]
//     wait_s = 0.5
//     [[frame]]
//     wait_input = 3                 # of a motor; "emergency", "forward", "reverse", "trigger"
//     active = true                  # false: until it is not
//     longest_s = 10                 # left out: for ever
//     [[frame]]
//     next = true
//
//     [[frame]]
//     move_by = { x = 500 }          # at most
//     until_input = "trigger"        # it ends when this is active
//     after = 2.5                    # and so much farther; left out: it ramps down
//
//     [[frame]]
//     travel_by = [60]               # to its limit switch and back
//     after_edge_s = 0.15            # of each edge at the trigger input; left out: once, at once
//     return_s = 0.3
//
//     [[frame]]
//     envelope = "in.envelope"       # a motion of several speeds (tables/speed_zones.h)
//
// END is what the file's end is.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "tables/speed_zones.h"
#include "tables/table.h"

namespace bushd::programs {

// Positions or distances; none: this motor does not take part.
using Point = std::vector<std::optional<double>>;

struct Move {
  // Ends a move of one motor by a distance.
  struct Until {
    std::uint8_t input = 0;  // as in the MCU (engine/program.h)
    bool active = true;
    double after = 0;  // a distance, without a sign; 0: a ramp-down
  };
  bool relative = false;
  Point to;
  std::optional<double> speed = {};
  std::optional<Until> until = {};
};
// All points have the same motors.
struct Line {
  bool relative = false;
  std::vector<Point> points;
  std::optional<double> speed = {};
  bool elementary = false;  // by engine/elementary.h
  std::optional<double> feed = {};
  // By these speeds; then its only point is the end, in the unit of these.
  std::optional<tables::SpeedZones> envelope = {};
};
// For one motor.
struct Travel {
  Point by;
  bool at_edges = false;
  std::uint32_t delay_us = 0;  // from an edge
  std::uint32_t return_us = 0;
};
struct Wait {
  std::uint32_t us = 0;
};
struct WaitInput {
  std::uint8_t input = 0;  // as in the MCU (engine/program.h)
  bool active = true;
  std::uint32_t longest_us = 0;  // 0: for ever
};
struct Pulse {
  std::uint32_t us = 0;
};
struct Repeat {
  std::uint16_t count = 0;  // 0: without end
};
struct Next {};

struct Frame {
  std::variant<Move, Line, Travel, Wait, WaitInput, Pulse, Repeat, Next> what;
  std::string place{};  // "scan.toml:7", for refusals
};

// Distances from where the motor is when the program begins; 0 is among them.
struct Range {
  double least = 0;
  double most = 0;
};

struct Program {
  std::vector<std::string> motors;
  bool without_host = false;
  bool kept = false;
  bool at_power_on = false;       // then it is kept, without a host, and goes by distances
  std::vector<Range> range = {};  // with at_power_on: of each motor
  bool steps = false;             // positions are steps, not user units
  // In place of tables, for lines and travels of its only motor; in any order.
  std::optional<tables::TableContent> codes{};
  // That of all its lines. Whoever knows the table of its motor makes `codes` of it.
  std::optional<tables::SpeedZones> envelope{};
  std::vector<Frame> frames;
};

// Reads a file of points, or of an envelope, that the text names, relative to wherever the caller
// keeps such files.
using ReadPoints = std::function<Result<std::string>(const std::string& file)>;

// `file` is what errors say. Errors name file, line, key and what is allowed.
Result<Program> parse(std::string_view text, const std::string& file, const ReadPoints& points);

}  // namespace bushd::programs
