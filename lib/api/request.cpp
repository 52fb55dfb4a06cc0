#include "api/request.h"

#include <array>

namespace bushd::api {
namespace {

// In the order of the variant.
constexpr std::array<std::string_view, std::variant_size_v<Request::variant>> kNames = {
    "move",
    "stop",
    "emergency stop",
    "enable",
    "disable",
    "set position",
    "clear faults",
    "use table",
    "reload tables",
    "home",
    "arm",
    "disarm",
    "position compare",
    "list tables",
    "get table",
    "set table",
    "confirm",
    "get history",
    "configure",
    "jog",
    "pause",
    "resume",
    "hold",
    "release",
    "move line",
    "camac",
    "move path",
    "follow",
    "arm line"};

}  // namespace

Request::Request() = default;
Request::Request(const Request&) = default;
Request::Request(Request&&) noexcept = default;
Request& Request::operator=(const Request&) = default;
Request& Request::operator=(Request&&) noexcept = default;
Request::~Request() = default;

std::string_view name_of(const Request& request) {
  return kNames[request.index()];
}

bool ends_motion(const Request& request) {
  if (const auto* jog = std::get_if<Jog>(&request)) return jog->per_s == 0 && !jog->renew;
  return std::holds_alternative<Stop>(request) || std::holds_alternative<EmergencyStop>(request) ||
         std::holds_alternative<Pause>(request) || std::holds_alternative<Hold>(request) ||
         std::holds_alternative<Disarm>(request);
}

bool is_repeatable(const Request& request) {
  if (const auto* configure = std::get_if<Configure>(&request)) {
    return configure->kind == Configure::Kind::kShow;
  }
  return std::holds_alternative<Stop>(request) || std::holds_alternative<EmergencyStop>(request) ||
         std::holds_alternative<ListTables>(request) || std::holds_alternative<GetTable>(request) ||
         std::holds_alternative<GetHistory>(request);
}

}  // namespace bushd::api
