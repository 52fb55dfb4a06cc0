#include "progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string_view>

#include "api/name_pattern.h"
#include "base/printable.h"
#include "motor_cells.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Status;

constexpr std::size_t kBarColumns = 24;

bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && kind != nullptr && std::string_view(kind) != "dumb";
}

// At the speed that it has now; nothing while that tells nothing.
std::optional<double> seconds_left(const api::MotorState& motor) {
  const double way = static_cast<double>(motor.target_steps - motor.position_steps);
  const double seconds = way / motor.velocity_steps_per_s;
  return std::isfinite(seconds) && seconds >= 0 ? std::optional(seconds) : std::nullopt;
}

std::string bar(double part, std::size_t columns) {
  const auto full = static_cast<std::size_t>(part * static_cast<double>(columns));
  std::string out(full, '=');
  if (full < columns) out += '>';
  out.resize(columns, ' ');
  return "[" + out + "] ";
}

}  // namespace

std::size_t columns_of_terminal(int fd) {
  winsize size{};
  const bool known = ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return (known ? size.ws_col : 80u) - 1u;
}

Progress::Progress(const api::MotorNames& motors)
    : asked_(motors), terminal_(is_terminal()), next_line_(Clock::now() + kBetweenLines) {}

std::string Progress::text(const Status& status, std::size_t columns) {
  std::string longest;
  double longest_s = -1;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const auto& motors = status.states[i].snapshot.motors;
    for (std::size_t m = 0; m < motors.size(); ++m) {
      const api::MotorState& motor = motors[m];
      const auto description = description_of(status.descriptions.at(i).snapshot, m, motor.name);
      const bool asked = !asked_.empty() && api::names_motor(asked_, motor.name, description.group);
      if (!asked || motor.trust == api::Trust::kUnknown) continue;
      const std::int64_t from =
          from_steps_.try_emplace(motor.name, motor.position_steps).first->second;
      if (!motor.moving || motor.position_steps == motor.target_steps) continue;
      const auto left_s = seconds_left(motor);
      const double order = left_s.value_or(std::numeric_limits<double>::max());
      if (order <= longest_s) continue;
      longest_s = order;
      const double whole =
          std::abs(static_cast<double>(motor.target_steps) - static_cast<double>(from));
      const double rest = std::abs(static_cast<double>(motor.target_steps - motor.position_steps));
      const double part = whole > 0 ? std::clamp(1 - rest / whole, 0.0, 1.0) : 0;
      longest = fmt::format("{} {}{:.0f} %, {}{}", bushd::printable(motor.name),
                            columns > 0 ? bar(part, columns) : "", std::floor(100 * part),
                            way_text(status, i, m),
                            left_s ? fmt::format(", {:.0f} s left", std::ceil(*left_s)) : "");
    }
  }
  return longest;
}

void Progress::show(const Status& status) {
  const std::string line = text(status, terminal_ ? kBarColumns : 0);
  if (line.empty()) return;
  if (terminal_) {
    fmt::print(stderr, "\r{:.{}}\x1b[K", line, columns_of_terminal(STDERR_FILENO));
    shown_ = true;
  } else if (Clock::now() >= next_line_) {
    fmt::print(stderr, "bushctl: {}\n", line);
    next_line_ = Clock::now() + kBetweenLines;
  }
  std::fflush(stderr);
}

void Progress::clear() {
  if (shown_) fmt::print(stderr, "\r\x1b[K");
  shown_ = false;
}

}  // namespace bushctl
