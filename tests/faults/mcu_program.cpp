#include "mcu_program.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace bushfaults {
namespace {

using Frame = McuProgram::Frame;
using Kind = Frame::Kind;

bool is_line(const Frame& frame) {
  return frame.kind == Kind::kLineBy || frame.kind == Kind::kLineTo;
}

bool is_move(const Frame& frame) {
  return frame.kind == Kind::kMoveBy || frame.kind == Kind::kMoveTo;
}

const char* key_of(Kind kind) {
  switch (kind) {
    case Kind::kMoveBy:
      return "move_by";
    case Kind::kMoveTo:
      return "move_to";
    case Kind::kLineBy:
      return "line_by";
    case Kind::kLineTo:
      return "line_to";
    case Kind::kWait:
      return "wait_s";
    case Kind::kPulse:
      return "pulse_us";
    case Kind::kRepeat:
      return "repeat";
    case Kind::kNext:
      break;
  }
  return "next";
}

std::string value_of(const Frame& frame, std::size_t width) {
  if (is_move(frame)) return fmt::format("[{}]", fmt::join(frame.steps, ", "));
  if (frame.kind == Kind::kWait) {
    return fmt::format("{}.{:03}", frame.number / 1000, frame.number % 1000);
  }
  if (frame.kind == Kind::kNext) return "true";
  if (!is_line(frame)) return fmt::format("{}", frame.number);
  std::string rows;
  for (std::size_t row = 0; row < frame.steps.size(); row += width) {
    const auto first = frame.steps.begin() + static_cast<std::ptrdiff_t>(row);
    rows += fmt::format("{}[{}]", row == 0 ? "" : ", ",
                        fmt::join(first, first + static_cast<std::ptrdiff_t>(width), ", "));
  }
  return "[" + rows + "]";
}

}  // namespace

bool McuProgram::is_like_line() const {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (is_line(frames[i])) return true;
    const bool waits = i + 1 < frames.size() && frames[i + 1].kind == Kind::kWait;
    if (is_move(frames[i]) && !waits) return true;
  }
  return false;
}

bool McuProgram::has_positions() const {
  return std::ranges::any_of(frames, [](const Frame& frame) {
    return frame.kind == Kind::kMoveTo || frame.kind == Kind::kLineTo;
  });
}

bool McuProgram::ends() const {
  return std::ranges::none_of(
      frames, [](const Frame& frame) { return frame.kind == Kind::kRepeat && frame.number == 0; });
}

std::string McuProgram::text() const {
  std::string text = "motors = [";
  for (const std::string& motor : motors) {
    text += fmt::format("{}\"{}\"", &motor == &motors.front() ? "" : ", ", motor);
  }
  text += "]\nunit = \"steps\"\n";
  if (without_host) text += "without_host = true\n";
  for (const Frame& frame : frames) {
    text += fmt::format("[[frame]]\n{} = {}\n", key_of(frame.kind), value_of(frame, motors.size()));
    if (frame.steps_per_s != 0) text += fmt::format("speed = {}\n", frame.steps_per_s);
    if (frame.elementary) text += "law = \"elementary\"\n";
  }
  return text;
}

// Repeats do not stand within each other here.
std::vector<std::int64_t> McuProgram::end(std::vector<std::int64_t> from,
                                          const std::vector<std::int64_t>& zero) const {
  if (!ends()) return {};
  std::size_t first = 0;
  std::int64_t passes_left = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    if (frame.kind == Kind::kRepeat) {
      first = i;
      passes_left = frame.number;
    } else if (frame.kind == Kind::kNext && --passes_left > 0) {
      i = first;
    }
    const bool to = frame.kind == Kind::kMoveTo || frame.kind == Kind::kLineTo;
    for (std::size_t k = 0; k < frame.steps.size(); ++k) {
      const std::size_t motor = k % motors.size();
      from[motor] = to ? zero[motor] + frame.steps[k] : from[motor] + frame.steps[k];
    }
  }
  return from;
}

}  // namespace bushfaults
