#include "api/request.h"

namespace bushd::api {
Request::Request() = default;
Request::Request(const Request&) = default;
Request::Request(Request&&) noexcept = default;
Request& Request::operator=(const Request&) = default;
Request& Request::operator=(Request&&) noexcept = default;
Request::~Request() = default;

std::string_view name_of(const Request& request) {
  return std::visit([](const auto& content) { return std::decay_t<decltype(content)>::kName; },
                    request);
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
