#include "mirror.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/overloaded.h"

namespace bushweb {
namespace {

namespace lcm = bushd::lcm;

// An object without the brace at its end, so that something may follow.
template <class T>
std::string open_object(std::int32_t part, const T& value, const char* without) {
  nlohmann::ordered_json told = {{"part", part}};
  told.update(bushd::json_of(value));
  if (without != nullptr) told.erase(without);
  std::string text = bushd::json_text(told);
  text.pop_back();
  return text;
}

std::string json_string(const std::string& text) {
  return bushd::json_text(nlohmann::json(text));
}

Text shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

}  // namespace

void Mirror::connect() {
  why_.clear();
  connection_fresh_ = true;
  full_ = true;
  mcus_.clear();
  descriptions_ = {};
  healths_ = {};
  collector_.clear();
}

void Mirror::lose(std::string why) {
  connection_fresh_ = connection_fresh_ || why != why_;
  why_ = std::move(why);
}

void Mirror::hear(const lcm::DaemonMessage& message) {
  std::visit(bushd::Overloaded{[this](const lcm::StateMessage& state) { hear_state(state); },
                               [this](const lcm::DescriptionMessage& description) {
                                 hear_from(description.part);
                                 collector_.add(description);
                                 hear_part(descriptions_, description);
                               },
                               [this](const lcm::HealthMessage& health) {
                                 collector_.add(health);
                                 hear_part(healths_, health);
                               },
                               [](const auto& /*of requests*/) {}},
             message);
}

// Another daemon than before, maybe of another configuration.
void Mirror::hear_from(const lcm::Part& part) {
  if (part.run == run_ && part.parts == part_count_) return;
  run_ = part.run;
  part_count_ = part.parts;
  full_ = true;
  mcus_.clear();
  descriptions_ = {};
  collector_.clear();
}

void Mirror::hear_state(const lcm::StateMessage& message) {
  const lcm::Part& part = message.part;
  hear_from(part);
  collector_.add(message);
  heard_ = true;
  utime_us_ = std::max(utime_us_, part.utime_us);
  Mcu& mcu = mcus_[part.part];
  const auto& motors = message.snapshot.motors;
  mcu.heard = true;
  mcu.motors.resize(motors.size());
  for (std::size_t i = 0; i < motors.size(); ++i) {
    Motor& motor = mcu.motors[i];
    if (!motor.json.empty() && motor.state == motors[i]) continue;
    motor.state = motors[i];
    motor.json = bushd::json_text(bushd::json_of(motor.state));
    motor.fresh = true;
  }
  api::StateSnapshot head = message.snapshot;
  head.motors.clear();
  mcu.json = open_object(part.part, head, "motors");
}

template <class Message>
void Mirror::hear_part(Parts& parts, const Message& message) {
  std::string json = open_object(message.part.part, message.snapshot, nullptr) + "}";
  parts.count = message.part.parts;
  Told& told = parts.told[message.part.part];
  if (told.json == json) return;
  told = {.json = std::move(json), .fresh = true};
}

Text Mirror::connection() const {
  return shared(fmt::format(R"({{"kind":"daemon","daemon":{},"connected":{},"why":{}}})",
                            json_string(daemon_), connected(), json_string(why_)));
}

Text Mirror::states(bool full) const {
  std::string text =
      fmt::format(R"({{"kind":"state","daemon":{},"utime_us":{},"full":{},"parts":{},"mcus":[)",
                  json_string(daemon_), utime_us_, full, part_count_);
  const char* before_mcu = "";
  for (const auto& [part, mcu] : mcus_) {
    if (!full && !mcu.heard) continue;
    text += std::exchange(before_mcu, ",") + mcu.json + R"(,"motors":[)";
    const char* before_motor = "";
    for (const Motor& motor : mcu.motors) {
      if (full || motor.fresh) text += std::exchange(before_motor, ",") + motor.json;
    }
    text += "]}";
  }
  return shared(text + "]}");
}

Text Mirror::parts(const char* kind, const char* list, const Parts& parts, bool full) const {
  std::string text = fmt::format(R"({{"kind":"{}","daemon":{},"full":{},"parts":{},"{}":[)", kind,
                                 json_string(daemon_), full, parts.count, list);
  const char* before = "";
  for (const auto& [part, told] : parts.told) {
    if (full || told.fresh) text += std::exchange(before, ",") + told.json;
  }
  return shared(text + "]}");
}

std::vector<Text> Mirror::news() {
  std::vector<Text> out;
  if (std::exchange(connection_fresh_, false)) out.push_back(connection());
  if (!connected()) return out;
  const auto fresh = [](auto& entry) { return entry.second.fresh; };
  const bool full = std::exchange(full_, false);
  if (full || std::ranges::any_of(descriptions_.told, fresh)) {
    out.push_back(parts("description", "mcus", descriptions_, full));
  }
  if (full || std::ranges::any_of(mcus_, [](auto& entry) { return entry.second.heard; })) {
    out.push_back(states(full));
  }
  if (full || std::ranges::any_of(healths_.told, fresh)) {
    out.push_back(parts("health", "buses", healths_, full));
  }
  for (auto& [part, told] : descriptions_.told) told.fresh = false;
  for (auto& [part, told] : healths_.told) told.fresh = false;
  for (auto& [part, mcu] : mcus_) {
    mcu.heard = false;
    for (Motor& motor : mcu.motors) motor.fresh = false;
  }
  return out;
}

std::vector<Text> Mirror::everything() const {
  return {connection(), parts("description", "mcus", descriptions_, true), states(true),
          parts("health", "buses", healths_, true)};
}

}  // namespace bushweb
