#include "remote.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/fields_from_json.h"
#include "base/parse_number.h"
#include "shallow_json.h"

namespace bushweb {
namespace {

namespace lcm = bushd::lcm;
using nlohmann::json;

constexpr std::int64_t kMostParts = 4096;
constexpr std::size_t kMostMotors = 1024;  // of an MCU, or of the axes of a bus

std::string text_in(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

bool is_true(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

const json& list_in(const json& object, const char* name) {
  static const json kNone = json::array();
  const auto found = object.find(name);
  return found != object.end() && found->is_array() ? *found : kNone;
}

std::int64_t number_in(const json& object, const char* name, std::int64_t otherwise) {
  const auto found = object.find(name);
  return found != object.end() && found->is_number_integer() ? found->get<std::int64_t>()
                                                             : otherwise;
}

// A value of a list, of which the members named here are no fields; nothing: it is none.
template <class T>
std::optional<T> value_of(const json& told, std::initializer_list<const char*> no_fields) {
  if (!told.is_object()) return std::nullopt;
  json fields = told;
  for (const char* name : no_fields) fields.erase(name);
  auto value = bushd::from_json<T>(fields);
  return value ? std::optional(std::move(*value)) : std::nullopt;
}

// Those that are told take the places of those before by their names.
void take_motors(api::StateSnapshot& mcu, const json& told) {
  for (const json& one : list_in(told, "motors")) {
    auto motor = value_of<api::MotorState>(one, {});
    if (!motor) continue;
    const auto known = std::ranges::find(mcu.motors, motor->name, &api::MotorState::name);
    if (known == mcu.motors.end()) {
      if (mcu.motors.size() >= kMostMotors) continue;
      mcu.motors.push_back(std::move(*motor));
    } else {
      *known = std::move(*motor);
    }
  }
}

bool is_port(std::string_view text, int& port) {
  port = bushd::parse_number<int>(text).value_or(0);
  return port > 0 && port < 65536;
}

}  // namespace

bushd::Result<RemoteName> remote_name(const std::string& told) {
  constexpr std::string_view kDaemon = "?daemon=";
  const auto wrong = [] {
    return bushd::fail("--remote: NAME=URL is expected, such as hutch=https://hutch.lab:8260/");
  };
  const std::size_t sign = told.find('=');
  if (sign == std::string::npos || sign == 0) return wrong();
  RemoteName remote{.name = told.substr(0, sign), .url = told.substr(sign + 1)};
  std::string_view rest = remote.url;
  remote.tls = rest.starts_with("https://");
  if (!remote.tls && !rest.starts_with("http://")) return wrong();
  rest.remove_prefix(rest.find("://") + 3);
  const std::size_t end = std::min(rest.find('/'), rest.size());
  std::string_view place = rest.substr(0, end);
  std::string_view path = rest.substr(std::min(end + 1, rest.size()));
  if (path.starts_with(kDaemon)) {
    remote.daemon = path.substr(kDaemon.size());
  } else if (!path.empty()) {
    return wrong();
  }
  const std::size_t colon = place.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return wrong();
  if (!is_port(place.substr(colon + 1), remote.port)) return wrong();
  remote.host = place.substr(0, colon);
  std::erase_if(remote.host, [](char c) { return c == '[' || c == ']'; });
  return remote;
}

Remote::Remote(RemoteName name, Dialer& dialer)
    : name_(std::move(name)), dialer_(dialer), mirror_(name_.name) {}

void Remote::tick(std::int64_t now_us) {
  now_us_ = now_us;
  if (dialled_ || now_us < try_at_us_) return;
  try_at_us_ = now_us + kTryAgainUs;
  heard_at_us_ = now_us;
  dialled_ = true;
  dialer_.dial(*this);
}

void Remote::on_end(const std::string& why) {
  dialled_ = false;
  open_ = false;
  mcus_.clear();
  mirror_.lose(fmt::format("{}: {}; the page there may tell more", name_.url, why));
}

void Remote::on_text(std::string_view text) {
  heard_at_us_ = now_us_;
  const json told = shallow_json(text);
  if (!told.is_object()) return;
  const std::string kind = text_in(told, "kind");
  if (kind == "hello") {
    const json& daemons = list_in(told, "daemons");
    daemon_ = name_.daemon;
    if (daemon_.empty() && !daemons.empty() && daemons[0].is_string()) {
      daemon_ = daemons[0].get<std::string>();
    }
  }
  if (text_in(told, "daemon") != daemon_) return;
  if (kind == "daemon") {
    if (is_true(told, "connected")) {
      mirror_.connect();
    } else {
      mirror_.lose(fmt::format("{}: {}", name_.url, text_in(told, "why")));
    }
  } else if (kind == "state") {
    hear_state(told);
  } else if (kind == "description") {
    hear_descriptions(told);
  } else if (kind == "health") {
    hear_health(told);
  }
}

lcm::Part Remote::part_of(const json& message, const json& one) {
  const auto number = [](const json& told, const char* name, std::int64_t least) {
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(number_in(told, name, least), least, kMostParts));
  };
  return {.utime_us = number_in(message, "utime_us", 0),
          .run = run_,
          .sequence = ++sequence_,
          .part = number(one, "part", 0),
          .parts = number(message, "parts", 1)};
}

void Remote::hear_state(const json& told) {
  if (is_true(told, "full")) mcus_.clear();
  for (const json& one : list_in(told, "mcus")) {
    auto head = value_of<api::StateSnapshot>(one, {"part", "motors"});
    if (!head) continue;
    lcm::StateMessage message;
    message.part = part_of(told, one);
    api::StateSnapshot& mcu = mcus_[message.part.part];
    head->motors = std::move(mcu.motors);
    mcu = std::move(*head);
    take_motors(mcu, one);
    message.snapshot = mcu;
    mirror_.hear(message);
  }
}

// They come before the states of a daemon that is heard for the first time.
void Remote::hear_descriptions(const json& told) {
  if (is_true(told, "full")) ++run_;
  for (const json& one : list_in(told, "mcus")) {
    auto snapshot = value_of<api::Description>(one, {"part"});
    if (!snapshot) continue;
    lcm::DescriptionMessage message;
    message.part = part_of(told, one);
    message.snapshot = std::move(*snapshot);
    mirror_.hear(message);
  }
}

void Remote::hear_health(const json& told) {
  for (const json& one : list_in(told, "buses")) {
    auto snapshot = value_of<api::HealthSnapshot>(one, {"part"});
    if (!snapshot) continue;
    // The last class of latencies has no bound, which is null.
    for (auto& latency : snapshot->latency) {
      if (latency.below_us == 0) latency.below_us = std::numeric_limits<std::int64_t>::max();
    }
    lcm::HealthMessage message;
    message.part = part_of(told, one);
    message.snapshot = std::move(*snapshot);
    mirror_.hear(message);
  }
}

}  // namespace bushweb
