#include "request.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "heritage/camac/module.h"

namespace bushfaults {
namespace {

namespace api = bushd::api;

std::optional<api::Speed> speed_of(const Request& request) {
  if (request.speed_micro == 0) return std::nullopt;
  return api::Speed{.per_s = static_cast<double>(request.speed_micro) / kMicro,
                    .in_steps = request.speed_in_steps};
}

api::Jog jog_of(const Request& request) {
  return {.motor = request.motors.front(),
          .per_s = static_cast<double>(request.speed_micro) / kMicro,
          .in_steps = request.speed_in_steps,
          .keepalive_ms = request.keepalive_ms,
          .renew = request.renew,
          .steps_after = request.steps_after};
}

// "12.345678"
std::string decimal(std::int64_t micro) {
  const std::int64_t size = std::abs(micro);
  return fmt::format("{}{}.{:06}", micro < 0 ? "-" : "", size / 1'000'000, size % 1'000'000);
}

std::pair<std::string, std::string> key_and_value(const Setting& setting) {
  switch (setting.key) {
    case Setting::Key::kOffset:
      return {"offset", decimal(setting.low)};
    case Setting::Key::kDirection:
      return {"direction", setting.low < 0 ? "negative" : "positive"};
    case Setting::Key::kSoftLimits:
      break;
  }
  if (setting.none) return {"soft_limits", "none"};
  return {"soft_limits", fmt::format("[{}, {}]", decimal(setting.low), decimal(setting.high))};
}

api::Configure configure_of(const Request& request) {
  api::Configure configure{.kind = api::Configure::Kind::kChange};
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    const auto [key, value] = key_and_value(request.settings[i]);
    configure.changes.push_back({.motor = request.motors[i], .key = key, .value = value});
  }
  return configure;
}

std::vector<api::MotorAmount> motor_steps(const Request& request) {
  std::vector<api::MotorAmount> all;
  for (std::size_t i = 0; i < request.motors.size(); ++i) {
    if (request.user) {
      const double user = static_cast<double>(request.steps[i]) / kMicro;
      all.push_back({request.motors[i], api::UserUnits{user}});
    } else {
      all.push_back({request.motors[i], request.steps[i]});
    }
  }
  return all;
}

api::MoveLine line_of(const Request& request) {
  return {
      .kind = request.ask == Ask::kMoveTo ? api::Move::Kind::kAbsolute : api::Move::Kind::kRelative,
      .motors = motor_steps(request),
      .speed = speed_of(request),
      .law = request.elementary ? api::MoveLine::Law::kElementary : api::MoveLine::Law::kLeading};
}

api::Edge edge_of(const Request& request) {
  return request.rising ? api::Edge::kRising : api::Edge::kFalling;
}

api::ArmLine armed_line_of(const Request& request) {
  return {.edge = edge_of(request),
          .delay_us = request.delay_us,
          .kind = api::Move::Kind::kRelative,
          .motors = motor_steps(request)};
}

// Those at one address are one, which shows the first word.
std::vector<std::pair<bushd::camac::Naf, int>> runs_of(
    const std::vector<bushd::camac::Naf>& cycles) {
  std::vector<std::pair<bushd::camac::Naf, int>> runs;
  for (const bushd::camac::Naf& naf : cycles) {
    const bool same = !runs.empty() && runs.back().first.station == naf.station &&
                      runs.back().first.subaddress == naf.subaddress &&
                      runs.back().first.function == naf.function;
    if (same) {
      ++runs.back().second;
    } else {
      runs.emplace_back(naf, 1);
    }
  }
  return runs;
}

std::vector<double> numbers_of(const std::vector<std::int64_t>& scaled, double by) {
  std::vector<double> numbers;
  for (const std::int64_t one : scaled) numbers.push_back(static_cast<double>(one) / by);
  return numbers;
}

api::MovePath path_of(const Request& request) {
  const std::size_t width = request.motors.size();
  const std::size_t rows = request.points.size() / width;
  const auto at = [&](std::size_t row) {
    return request.points.begin() + static_cast<std::ptrdiff_t>(row * width);
  };
  const std::vector<std::int64_t> told(at(request.first_row),
                                       at(request.end_row == 0 ? rows : request.end_row));
  return {.motors = request.motors,
          .rows = static_cast<std::int32_t>(rows),
          .first_row = static_cast<std::int32_t>(request.first_row),
          .positions = numbers_of(told, kMicro),
          .speeds = request.point_speeds,
          .corners =
              request.exact ? api::MovePath::Corners::kExact : api::MovePath::Corners::kContinuous,
          .speed = speed_of(request)};
}

api::Follow follow_of(const Request& request) {
  using Part = api::Follow::Part;
  const bool rows = request.ask == Ask::kRows;
  return {.part = !rows               ? Part::kRun
                  : request.last_rows ? Part::kLastRows
                                      : Part::kRows,
          .array = request.trajectory,
          .motors = request.motors,
          .cubic = request.cubic,
          .time_s = numbers_of(request.times_ms, 1000),
          .positions = numbers_of(request.points, kMicro)};
}

std::string_view word_of(const Request& request) {
  switch (request.ask) {
    case Ask::kMoveBy:
      if (request.elementary) return "elementary line by";
      return request.line ? "line by" : "move by";
    case Ask::kMoveTo:
      if (!request.points.empty()) return request.exact ? "exact path to" : "path to";
      if (request.trajectory != 0) return "follow to";
      if (request.elementary) return "elementary line to";
      return request.line ? "line to" : "move to";
    case Ask::kArm:
      if (request.line) return request.rising ? "arm line (rising)" : "arm line (falling)";
      return request.rising ? "arm (rising)" : "arm (falling)";
    default:
      return name_of(api_of(request));
  }
}

std::string text_of(const bushd::lcm::RequestId& id) {
  return fmt::format("{} {:04x} #{}", id.client_id.substr(0, 16), id.session & 0xFFFF, id.number);
}

}  // namespace

api::Request api_of(const Request& request) {
  switch (request.ask) {
    case Ask::kMoveBy:
      if (request.line) return line_of(request);
      return api::Move{.kind = api::Move::Kind::kRelative,
                       .motors = motor_steps(request),
                       .speed = speed_of(request)};
    case Ask::kMoveTo:
      if (!request.points.empty()) return path_of(request);
      if (request.trajectory != 0) return follow_of(request);
      if (request.line) return line_of(request);
      return api::Move{.kind = api::Move::Kind::kAbsolute,
                       .motors = motor_steps(request),
                       .speed = speed_of(request)};
    case Ask::kStop:
      return api::Stop{request.motors};
    case Ask::kEnable:
      return api::Enable{request.motors};
    case Ask::kDisable:
      return api::Disable{request.motors};
    case Ask::kSetPosition:
      return api::SetPosition{.motors = motor_steps(request), .dial = request.dial};
    case Ask::kClearFaults:
      return api::ClearFaults{request.motors};
    case Ask::kEmergencyStop:
      return api::EmergencyStop{};
    case Ask::kHome:
      return api::Home{request.motors};
    case Ask::kArm:
      if (request.line) return armed_line_of(request);
      return api::Arm{
          .edge = edge_of(request), .delay_us = request.delay_us, .motors = motor_steps(request)};
    case Ask::kConfirm:
      return api::Confirm{request.motors};
    case Ask::kJog:
      return jog_of(request);
    case Ask::kPause:
      return api::Pause{request.motors};
    case Ask::kResume:
      return api::Resume{request.motors};
    case Ask::kHold:
      return api::Hold{request.motors};
    case Ask::kRelease:
      return api::Release{request.motors};
    case Ask::kConfigure:
      return configure_of(request);
    case Ask::kRows:
      if (request.trajectory == 0) return path_of(request);
      return follow_of(request);
    case Ask::kCamac:
      return api::Camac{.block = {.mode = request.block_mode,
                                  .cycles = request.cycles,
                                  .count = request.block_mode == bushd::camac::BlockMode::kSingle
                                               ? static_cast<std::uint32_t>(request.cycles.size())
                                               : request.words,
                                  .last_station = request.last_station}};
    case Ask::kPutProgram:
      return api::PutProgram{.program = request.program.name,
                             .text = request.program.text(),
                             .dry_run = request.program.dry_run};
    case Ask::kEraseProgram:
      return api::EraseProgram{request.programs.front()};
    case Ask::kRunPrograms:
      return api::RunPrograms{request.programs};
    case Ask::kDisarm:
      break;
  }
  return api::Disarm{request.motors};
}

bushd::lcm::Packet packet_of(const Request& request) {
  bushd::lcm::Packet packet =
      bushd::lcm::encode(request.sent_us, request.id(), api_of(request)).value();
  switch (request.damage) {
    case Damage::kNone:
      break;
    case Damage::kOtherType:
      packet.payload.front() ^= 1;
      break;
    case Damage::kTruncated:
      packet.payload.pop_back();
      break;
    case Damage::kTooLong:
      packet.payload.push_back(0);
      break;
    case Damage::kOtherChannel:
      packet.channel = "HELLO";
      break;
  }
  return packet;
}

std::string text_of(const Request& request) {
  std::string how = request.user ? request.dial ? " millionths on the dial" : " millionths" : "";
  if (request.speed_micro != 0) {
    how += fmt::format(" at {} millionths{}/s", request.speed_micro,
                       request.speed_in_steps ? " of a step" : "");
  }
  if (request.renew) how += " (renewed)";
  if (request.ask == Ask::kJog) how += fmt::format(", {} ms", request.keepalive_ms);
  if (request.steps_after) how += fmt::format(", {} steps after", *request.steps_after);
  if (request.trajectory != 0) how += fmt::format(" trajectory {}", request.trajectory);
  if (!request.points.empty()) how += fmt::format(" by {}", fmt::join(request.points, ","));
  if (!request.times_ms.empty()) how += fmt::format(" at {}", fmt::join(request.times_ms, ","));
  for (const auto& [naf, count] : runs_of(request.cycles)) {
    how += fmt::format(" N{}A{}F{}", naf.station, naf.subaddress, naf.function);
    if (bushd::camac::writes(naf.function)) how += fmt::format(":{:#x}", naf.data);
    if (count > 1) how += fmt::format("*{}", count);
  }
  for (const Setting& setting : request.settings) {
    const auto [key, value] = key_and_value(setting);
    how += fmt::format(" {}={}", key, value);
  }
  if (request.ask == Ask::kPutProgram) {
    how += fmt::format("{}{}:\n{}", request.program.name,
                       request.program.dry_run ? " (dry run)" : "", request.program.text());
  }
  if (!request.programs.empty()) how += fmt::format(" {}", fmt::join(request.programs, ","));
  return fmt::format("{}: {} {} {}{}{}", text_of(request.id()), word_of(request),
                     fmt::join(request.motors, ","), fmt::join(request.steps, ","), how,
                     request.damage == Damage::kNone ? "" : " (broken)");
}

std::string text_of(const Key& key, const api::Reply& reply) {
  const auto& [session, client, number] = key;
  return text_of(bushd::lcm::ReplyMessage{
      .id = {.session = session, .client_id = client, .number = number}, .reply = reply});
}

std::string text_of(const bushd::lcm::ReplyMessage& message) {
  std::string text = "  " + text_of(message.id) + ": ";
  if (const auto* refused = std::get_if<api::Refused>(&message.reply)) {
    return text + "refused (" + refused->reason + ")";
  }
  const auto* completed = std::get_if<api::Completed>(&message.reply);
  if (completed == nullptr) return text + "accepted";
  text += fmt::format("{} ({})", word(completed->outcome), completed->reason);
  if (const auto* motors = std::get_if<std::vector<api::MotorResult>>(&completed->detail)) {
    for (const api::MotorResult& motor : *motors) {
      text += fmt::format(" {} {} {}", motor.motor, word(motor.outcome), motor.position_steps);
    }
  }
  return text;
}

}  // namespace bushfaults
