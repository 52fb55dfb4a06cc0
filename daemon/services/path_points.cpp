#include "daemon/services/path_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace bushd::daemon {
namespace {

using api::MovePath;

Result<void> check(const MovePath& part) {
  const std::size_t width = part.motors.size();
  if (width == 0 || width > api::MoveLine::kMostMotors) {
    return fail(
        fmt::format("{} motors are named; a path has 1 to {}", width, api::MoveLine::kMostMotors));
  }
  if (part.rows < 1 || part.rows > MovePath::kMostRows) {
    return fail(fmt::format("path of {} points; allowed: 1 to {}; make several paths of it",
                            part.rows, MovePath::kMostRows));
  }
  if (static_cast<std::size_t>(part.rows) * width > PathPoints::kMostValues) {
    return fail(
        fmt::format("path of {} points of {} motors; allowed: {} positions in all; make "
                    "several paths of it",
                    part.rows, width, PathPoints::kMostValues));
  }
  const std::size_t values = part.positions.size();
  if (values == 0 || values > MovePath::kMostValues || values % width != 0) {
    return fail(
        fmt::format("{} positions of {} motors in one request; allowed: whole rows, at "
                    "most {} positions",
                    values, width, MovePath::kMostValues));
  }
  const std::size_t rows = values / width;
  if (!part.speeds.empty() && (width != 1 || part.speeds.size() != rows)) {
    return fail("speeds of points are of a path of one motor, one for each of its points");
  }
  const auto finite = [](double value) { return std::isfinite(value); };
  const auto wrong = std::ranges::find_if_not(part.positions, finite);
  if (wrong != part.positions.end()) {
    const auto at = static_cast<std::size_t>(wrong - part.positions.begin());
    return fail(fmt::format("point {}, {}: {} is no position",
                            static_cast<std::size_t>(std::max(part.first_row, 0)) + at / width + 1,
                            part.motors[at % width], *wrong));
  }
  return {};
}

}  // namespace

Result<std::optional<MovePath>> PathPoints::take(const api::Asker& asker, const MovePath& part) {
  if (auto good = check(part); !good) return fail(good.error());
  const std::string client = asker.session ? asker.session->client_id() : std::string();
  auto begun = std::ranges::find(begun_, client, &Begun::client);
  if (part.first_row == 0) {
    if (begun != begun_.end()) begun_.erase(begun);
    if (begun_.size() == kMost) begun_.pop_front();
    MovePath path = part;
    path.positions.clear();
    path.speeds.clear();
    begun = begun_.insert(begun_.end(), {client, std::move(path)});
  }
  if (begun == begun_.end()) {
    return fail("the path's first points are not here any more; send it again from its beginning");
  }
  MovePath& path = begun->path;
  const std::size_t width = path.motors.size();
  const std::size_t taken = path.positions.size() / width;
  const bool same =
      part.motors == path.motors && part.rows == path.rows &&
      part.speeds.empty() == (path.speeds.empty() && (taken > 0 || part.speeds.empty()));
  if (!same || part.first_row < 0 || static_cast<std::size_t>(part.first_row) != taken) {
    const std::string why =
        same ? fmt::format("points from {} on where those from {} on were to come",
                           part.first_row + 1, taken + 1)
             : std::string("it is of other motors, or of another number of points, than before");
    begun_.erase(begun);
    return fail(why + "; send the path again from its beginning");
  }
  path.positions.insert(path.positions.end(), part.positions.begin(), part.positions.end());
  path.speeds.insert(path.speeds.end(), part.speeds.begin(), part.speeds.end());
  const std::size_t whole = static_cast<std::size_t>(path.rows) * width;
  if (path.positions.size() < whole) return std::nullopt;
  MovePath complete = std::move(path);
  begun_.erase(begun);
  if (complete.positions.size() > whole) {
    return fail(
        fmt::format("{} points of a path of {}", complete.positions.size() / width, complete.rows));
  }
  return complete;
}

}  // namespace bushd::daemon
