#include "daemon/core/request_log.h"

#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "api/introduction.h"
#include "base/json_text.h"

namespace bushd::daemon {
namespace {

void put_motors(nlohmann::json& line, const auto& request) {
  if constexpr (requires { request.motors.front().amount; }) {
    for (const api::MotorAmount& motor : request.motors) line["motors"].push_back(motor.motor);
  } else if constexpr (requires { request.changes; }) {
    for (const auto& change : request.changes) line["motors"].push_back(change.motor);
  } else if constexpr (requires { request.motors; }) {
    for (const std::string& motor : request.motors) line["motors"].push_back(motor);
  } else if constexpr (requires { request.motor; }) {
    line["motors"].push_back(request.motor);
  }
}

bool is_logged(const api::Request& request) {
  const auto* move = std::get_if<api::Move>(&request);
  if (move != nullptr) return !move->dry_run;
  const auto* line = std::get_if<api::MoveLine>(&request);
  if (line != nullptr) return !line->dry_run;
  const auto* path = std::get_if<api::MovePath>(&request);
  if (path != nullptr) return !path->dry_run && path->first_row == 0;
  const auto* follow = std::get_if<api::Follow>(&request);
  if (follow != nullptr) return follow->part == api::Follow::Part::kRun;
  const auto* jog = std::get_if<api::Jog>(&request);
  if (jog != nullptr) return !jog->renew;
  return api::ends_motion(request) || !api::is_repeatable(request);
}

const char* word(api::Transport transport) {
  switch (transport) {
    case api::Transport::kSocket:
      return "socket";
    case api::Transport::kCamac:
      return "camac";
    case api::Transport::kLcm:
      break;
  }
  return "lcm";
}

std::string line_of(std::int64_t unix_us, const api::Session& session, std::int64_t number,
                    const api::Request& request) {
  nlohmann::json line = {{"event", "request"},
                         {"utime_us", unix_us},
                         {"request", api::name_of(request)},
                         {"client", session.client_id()},
                         {"number", number},
                         {"by", word(session.transport())}};
  if (const auto& credentials = session.credentials()) {
    line["uid"] = credentials->uid;
    line["pid"] = credentials->pid;
  }
  if (const auto introduction = api::introduction_of(session.client_id())) {
    line["program"] = introduction->program;
    line["host"] = introduction->host;
  }
  std::visit([&line](const auto& content) { put_motors(line, content); }, request);
  // Names are as clients wrote them; what is not UTF-8 must not end the daemon.
  return json_text(line);
}

// Stands for the session of one request until that is answered.
class Logged : public api::Session {
 public:
  Logged(std::shared_ptr<api::Session> session, const api::Request& request, Outputs& outputs)
      : Session(session->transport(), session->client_id(), session->may_command(),
                session->credentials()),
        session_(std::move(session)),
        request_(request),
        outputs_(outputs) {}

  void answer(std::int64_t number, const api::Reply& reply) override {
    // A stop may be over when it is answered. What a stop has ended before it began is not logged.
    const bool over = std::holds_alternative<api::Completed>(reply) && api::ends_motion(request_);
    const bool accepted = std::holds_alternative<api::Accepted>(reply);
    if ((accepted || over) && !std::exchange(written_, true)) {
      outputs_.move_log(line_of(outputs_.wall_clock_us(), *this, number, request_));
    }
    session_->answer(number, reply);
  }
  bool gone() const override { return session_->gone(); }

 private:
  std::shared_ptr<api::Session> session_;
  api::Request request_;
  Outputs& outputs_;
  bool written_ = false;
};

}  // namespace

api::Asker logged(const api::Asker& asker, const api::Request& request, Outputs& outputs) {
  if (!is_logged(request)) return asker;
  return {.session = std::make_shared<Logged>(asker.session, request, outputs),
          .number = asker.number,
          .after_stops = asker.after_stops};
}

}  // namespace bushd::daemon
