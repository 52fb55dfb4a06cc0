#include "daemon/services/path_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/services/allowed.h"

namespace bushd::daemon {
namespace {

using api::MovePath;

Result<void> check(const MovePath& part) {
  const std::size_t width = part.motors.size();
  if (constexpr auto kMotors = api::MoveLine::kMotors; !kMotors.has(width)) {
    return fail(fmt::format("{} motors are named; a path has {} to {}", width, kMotors.least,
                            kMotors.most));
  }
  if (!MovePath::kRows.has(part.rows)) {
    return fail(fmt::format("path of {} points{}; make several paths of it", part.rows,
                            allowed(MovePath::kRows)));
  }
  if (static_cast<std::size_t>(part.rows) * width > PathPoints::kMostValues) {
    return fail(
        fmt::format("path of {} points of {} motors; allowed: {} positions in all; make "
                    "several paths of it",
                    part.rows, width, PathPoints::kMostValues));
  }
  const std::size_t values = part.positions.size();
  if (!MovePath::kValues.has(values) || values % width != 0) {
    return fail(
        fmt::format("{} positions of {} motors in one request; allowed: whole rows, at "
                    "most {} positions",
                    values, width, MovePath::kValues.most));
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

Result<bool> PathPoints::take(const std::string& client, const MovePath& part) {
  if (auto good = check(part); !good) return fail(good.error());
  if (part.first_row == 0) {
    drop(client);
    if (begun_.size() == kMost) begun_.pop_front();
    MovePath first = part;
    first.positions.clear();
    first.speeds.clear();
    begun_.push_back({client, std::move(first), !part.speeds.empty()});
  }
  const auto begun = std::ranges::find(begun_, client, &Begun::client);
  if (begun == begun_.end()) {
    return fail("the path's first points are not here any more; send it again from its beginning");
  }
  const auto& [name, first, has_speeds, taken] = *begun;
  std::string why;
  const auto rows = static_cast<std::int32_t>(part.positions.size() / part.motors.size());
  if (part.motors != first.motors || part.rows != first.rows || part.speeds.empty() == has_speeds) {
    why = "it is of other motors, or of another number of points, than before";
  } else if (part.dry_run != first.dry_run) {
    why = first.dry_run ? "it is to move, and the points before are of a dry run"
                        : "it is a dry run, and the points before are to move";
  } else if (part.first_row != taken) {
    why = fmt::format("points from {} on where those from {} on were to come", part.first_row + 1,
                      taken + 1);
  } else if (rows > first.rows - taken) {
    why = fmt::format("{} points of a path of {}", std::int64_t{taken} + rows, first.rows);
  }
  if (!why.empty()) {
    begun_.erase(begun);
    return fail(why + "; send the path again from its beginning");
  }
  begun->rows += rows;
  const bool last = begun->rows == part.rows;
  if (last) begun_.erase(begun);
  return last;
}

void PathPoints::drop(const std::string& client) {
  std::erase_if(begun_, [&](const Begun& one) { return one.client == client; });
}

bool PathPoints::has(const std::string& client) const {
  return std::ranges::find(begun_, client, &Begun::client) != begun_.end();
}

}  // namespace bushd::daemon
