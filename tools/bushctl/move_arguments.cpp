#include "move_arguments.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <utility>

#include "base/parse_number.h"
#include "base/shortened.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::fail;
using bushd::Result;

constexpr const char* kMoveUsage =
    "write NAME DISTANCE [NAME DISTANCE...] or NAME --to POSITION [NAME --to POSITION...]";

Result<api::Amount> amount_of(const std::string& motor, const std::string& word, Numbers numbers) {
  if (numbers == Numbers::kSteps) {
    if (const auto steps = bushd::parse_signed<std::int64_t>(word)) return *steps;
    return fail(fmt::format("{}: \"{}\" is not a whole number of steps", bushd::shortened(motor),
                            bushd::shortened(word)));
  }
  if (const auto user = bushd::parse_signed<double>(word)) return api::UserUnits{*user};
  return fail(
      fmt::format("{}: \"{}\" is not a number", bushd::shortened(motor), bushd::shortened(word)));
}

}  // namespace

Result<std::optional<api::Speed>> parse_speed(const std::string& word, Numbers numbers) {
  if (word.empty()) return std::optional<api::Speed>();
  const auto per_s = bushd::parse_signed<double>(word);
  if (!per_s || !(*per_s > 0)) {
    return fail(fmt::format("--speed: \"{}\" is not a number above 0", bushd::shortened(word)));
  }
  return std::optional(api::Speed{.per_s = *per_s, .in_steps = numbers == Numbers::kSteps});
}

Result<api::Move> parse_move(const std::vector<std::string>& words, Numbers numbers) {
  using Kind = api::Move::Kind;
  api::Move move;
  for (std::size_t i = 0; i < words.size();) {
    const std::string& motor = words[i++];
    if (motor.starts_with("--")) {
      return fail(fmt::format("\"{}\" stands where a motor's name should; {}", motor, kMoveUsage));
    }
    if (i == words.size()) {
      return fail(fmt::format("{}: the distance is missing; {}", motor, kMoveUsage));
    }
    std::string number = words[i++];
    const bool absolute = number == "--to" || number.starts_with("--to=");
    if (number == "--to") {
      if (i == words.size()) return fail(motor + ": --to wants the position after it");
      number = words[i++];
    } else if (absolute) {
      number.erase(0, std::string("--to=").size());
    }
    const auto amount = amount_of(motor, number, numbers);
    if (!amount) return fail(fmt::format("{}; {}", amount.error().message, kMoveUsage));
    const Kind kind = absolute ? Kind::kAbsolute : Kind::kRelative;
    if (!move.motors.empty() && move.kind != kind) {
      return fail(fmt::format(
          "{} is moved {}, the motors before it {}: one command is either. Give --to to "
          "all or to none, or send two commands",
          motor, absolute ? "to a position" : "by a distance",
          absolute ? "by distances" : "to positions"));
    }
    move.kind = kind;
    move.motors.push_back({motor, *amount});
  }
  if (move.motors.empty()) return fail(fmt::format("no motor is named; {}", kMoveUsage));
  return move;
}

Result<api::MoveLine> parse_move_line(const std::vector<std::string>& words, Numbers numbers,
                                      const LineOptions& options) {
  auto move = parse_move(words, numbers);
  if (!move) return fail(move.error());
  api::MoveLine line{.kind = move->kind, .motors = std::move(move->motors)};
  if (options.law == "elementary") line.law = api::MoveLine::Law::kElementary;
  const auto feed = parse_feed(options.feed, numbers);
  if (!feed) return fail(feed.error());
  line.feed = *feed;
  if (options.duration.empty()) return line;
  line.duration_s = bushd::parse_signed<double>(options.duration);
  if (line.duration_s && *line.duration_s > 0) return line;
  return fail(
      fmt::format("--duration: \"{}\" is not a number of seconds above 0", options.duration));
}

Result<std::optional<api::Speed>> parse_feed(const std::string& word, Numbers numbers) {
  if (word.empty()) return std::optional<api::Speed>{};
  const auto per_s = bushd::parse_signed<double>(word);
  if (per_s && *per_s > 0) {
    return std::optional(api::Speed{.per_s = *per_s, .in_steps = numbers == Numbers::kSteps});
  }
  return fail(fmt::format("--feed: \"{}\" is not a number above 0", word));
}

namespace {

api::Edge edge_of(const std::string& word) {
  return word == "falling" ? api::Edge::kFalling : api::Edge::kRising;
}

}  // namespace

Result<api::ArmLine> parse_arm_line(const std::vector<std::string>& words, Numbers numbers,
                                    const std::string& edge, std::int64_t delay_us,
                                    const std::string& duration) {
  auto line = parse_move_line(words, numbers, {.duration = duration});
  if (!line) return fail(line.error());
  return api::ArmLine{.edge = edge_of(edge),
                      .delay_us = delay_us,
                      .kind = line->kind,
                      .motors = std::move(line->motors),
                      .duration_s = line->duration_s};
}

Result<api::Arm> parse_arm(const std::vector<std::string>& words, Numbers numbers,
                           const std::string& edge, std::int64_t delay_us) {
  const auto move = parse_move(words, numbers);
  if (!move) return fail(move.error());
  if (move->kind != api::Move::Kind::kRelative) {
    return fail(
        "--to: what waits for the trigger is moved by a distance; write NAME DISTANCE, or --line");
  }
  return api::Arm{.edge = edge_of(edge), .delay_us = delay_us, .motors = move->motors};
}

Result<api::PositionCompare> parse_position_compare(const std::string& motor,
                                                    const std::string& where, Numbers numbers,
                                                    const Pulse& pulse) {
  api::PositionCompare compare{.motor = motor};
  if (where == "off") return compare;
  const auto position = amount_of(motor, where, numbers);
  if (!position) return fail(position.error().message + ", nor off");
  compare.position = *position;
  compare.arrivals = {.positive = pulse.direction != "negative",
                      .negative = pulse.direction != "positive"};
  compare.delay_us = pulse.delay_us;
  compare.width_us = pulse.width_us;
  return compare;
}

Result<api::SetPosition> parse_set(const std::string& motor, const std::string& word,
                                   Numbers numbers, bool dial) {
  const auto position = amount_of(motor, word, numbers);
  if (!position) return fail(position.error());
  return api::SetPosition{.motors = {{motor, *position}}, .dial = dial};
}

}  // namespace bushctl
