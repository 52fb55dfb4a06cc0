#include "path_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "base/csv/number_csv.h"
#include "base/parse_number.h"
#include "base/shortened.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::fail;
using bushd::Result;

// A path in requests of as many points as one may have.
std::vector<api::MovePath> in_parts(const api::MovePath& whole) {
  const std::size_t width = whole.motors.size();
  const std::size_t rows = whole.positions.size() / width;
  const std::size_t most = std::max<std::size_t>(api::MovePath::kValues.most / width, 1);
  std::vector<api::MovePath> parts;
  for (std::size_t first = 0; first < rows; first += most) {
    const std::size_t end = std::min(first + most, rows);
    api::MovePath part = whole;
    part.first_row = static_cast<std::int32_t>(first);
    const auto cut = [](std::vector<double>& values, std::size_t begin, std::size_t stop) {
      values = {values.begin() + static_cast<std::ptrdiff_t>(begin),
                values.begin() + static_cast<std::ptrdiff_t>(stop)};
    };
    cut(part.positions, first * width, end * width);
    if (!part.speeds.empty()) cut(part.speeds, first, end);
    parts.push_back(std::move(part));
  }
  return parts;
}

struct SpeedAt {
  double position;
  double speed;
};

Result<SpeedAt> speed_at(const std::string& word) {
  const std::size_t colon = word.find(':');
  if (colon != std::string::npos) {
    const auto position = bushd::parse_number<double>(std::string_view(word).substr(0, colon));
    const auto speed = bushd::parse_number<double>(std::string_view(word).substr(colon + 1));
    if (position && speed && *speed > 0) return SpeedAt{*position, *speed};
  }
  return fail(
      fmt::format("--speed-at: \"{}\" is not a position and a speed above 0; write "
                  "--speed-at POSITION:SPEED",
                  bushd::shortened(word)));
}

}  // namespace

std::string PathFile::located(const std::string& reason) const {
  constexpr std::string_view kPoint = "point ";
  if (!reason.starts_with(kPoint)) return reason;
  std::size_t point = 0;
  const char* const begin = reason.data() + kPoint.size();
  const auto [stop, error] = std::from_chars(begin, reason.data() + reason.size(), point);
  if (error != std::errc{} || point == 0 || point > lines.size()) return reason;
  return fmt::format("{}, line {}{}", file, lines[point - 1], std::string_view(stop));
}

Result<PathFile> parse_path(std::string_view text, const std::string& file,
                            const std::string& corners, const std::string& speed,
                            const std::string& feed) {
  auto table = bushd::csv::parse_numbers(text, file, api::MovePath::kRows.most);
  if (!table) return fail(table.error());
  const auto along = parse_feed(feed, Numbers::kUser);
  if (!along) return fail(along.error());
  const auto not_faster = parse_speed(speed, Numbers::kUser);
  if (!not_faster) return fail(not_faster.error());
  const std::size_t width = table->columns.size();
  if (width > api::MoveLine::kMotors.most) {
    return fail(fmt::format("{}: {} columns; a path has at most {} motors", file, width,
                            api::MoveLine::kMotors.most));
  }
  api::MovePath whole{.motors = {},
                      .rows = static_cast<std::int32_t>(table->rows()),
                      .corners = corners == "exact" ? api::MovePath::Corners::kExact
                                                    : api::MovePath::Corners::kContinuous,
                      .speed = *not_faster,
                      .feed = *along};
  for (const auto& column : table->columns) whole.motors.push_back(column.name);
  whole.positions.reserve(table->rows() * width);
  for (std::size_t row = 0; row < table->rows(); ++row) {
    for (const auto& column : table->columns) whole.positions.push_back(column.numbers[row]);
  }
  return PathFile{.parts = in_parts(whole), .file = file, .lines = std::move(table->lines)};
}

Result<std::vector<api::MovePath>> parse_speed_profile(const std::vector<std::string>& words,
                                                       Numbers numbers, const std::string& speed) {
  std::vector<SpeedAt> zones;
  std::vector<std::string> rest;
  const std::string option = "--speed-at";
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string word = words[i];
    if (word == option) {
      if (i + 1 == words.size()) return fail("--speed-at wants POSITION:SPEED after it");
      word = words[++i];
    } else if (word.starts_with(option + "=")) {
      word.erase(0, option.size() + 1);
    } else {
      rest.push_back(word);
      continue;
    }
    const auto zone = speed_at(word);
    if (!zone) return fail(zone.error());
    zones.push_back(*zone);
  }
  if (zones.empty()) return std::vector<api::MovePath>{};
  if (numbers == Numbers::kSteps) {
    return fail("--speed-at: positions and speeds are in the motor's unit; leave out --steps");
  }
  const auto move = parse_move(rest, numbers);
  if (!move) return fail(move.error());
  if (move->motors.size() != 1 || move->kind != api::Move::Kind::kAbsolute) {
    return fail("--speed-at is for one motor that moves to a position: write NAME --to POSITION");
  }
  const auto not_faster = parse_speed(speed, numbers);
  if (!not_faster) return fail(not_faster.error());
  api::MovePath path{.motors = {move->motors.front().motor}, .speed = *not_faster};
  // The way to a point has the speed of the one before it.
  double before = 0;
  for (const SpeedAt& zone : zones) {
    path.positions.push_back(zone.position);
    path.speeds.push_back(std::exchange(before, zone.speed));
  }
  path.positions.push_back(std::get<api::UserUnits>(move->motors.front().amount).value);
  path.speeds.push_back(before);
  path.rows = static_cast<std::int32_t>(path.positions.size());
  return in_parts(path);
}

}  // namespace bushctl
