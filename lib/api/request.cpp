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
  return ends(std::visit([](const auto& content) { return content.motion(); }, request));
}

bool is_repeatable(const Request& request) {
  return std::visit(
      [](const auto& content) {
        if constexpr (requires { content.is_repeatable(); }) return content.is_repeatable();
        return false;
      },
      request);
}

}  // namespace bushd::api
