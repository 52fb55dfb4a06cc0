#include "daemon/request_log.h"

#include <nlohmann/json.hpp>

namespace bushd::daemon {
namespace {

void put_motors(nlohmann::json& line, const auto& request) {
  if constexpr (requires { request.motors.front().steps; }) {
    for (const api::MotorSteps& motor : request.motors) line["motors"].push_back(motor.motor);
  } else if constexpr (requires { request.motors; }) {
    for (const std::string& motor : request.motors) line["motors"].push_back(motor);
  } else if constexpr (requires { request.motor; }) {
    line["motors"].push_back(request.motor);
  }
}

}  // namespace

bool is_logged(const api::Request& request) {
  const auto* move = std::get_if<api::Move>(&request);
  if (move != nullptr) return !move->dry_run;
  return api::is_stop(request) || !api::is_repeatable(request);
}

std::string request_line(std::int64_t unix_us, const api::Asker& asker,
                         const api::Request& request) {
  const api::Session& session = *asker.session;
  nlohmann::json line = {{"event", "request"},
                         {"utime_us", unix_us},
                         {"request", api::name_of(request)},
                         {"client", session.client_id()},
                         {"number", asker.number},
                         {"by", session.transport() == api::Transport::kSocket ? "socket" : "lcm"}};
  if (const auto& credentials = session.credentials()) {
    line["uid"] = credentials->uid;
    line["pid"] = credentials->pid;
  }
  std::visit([&line](const auto& content) { put_motors(line, content); }, request);
  // Names are as clients wrote them; what is not UTF-8 must not end the daemon.
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace bushd::daemon
