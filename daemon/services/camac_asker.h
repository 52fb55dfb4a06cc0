// CAMAC modules ask for motion by the requests that all clients use.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "api/session.h"

namespace bushd::daemon {

// Carries a request out, or holds it until it can be.
using AskCore =
    std::function<void(std::int64_t now_us, const api::Asker& asker, const api::Request& request)>;

// After how many stops (precedence.h) what modules are told now has arrived: they begin motion by
// it.
struct CamacTurn {
  std::uint64_t after_stops = 0;
};

// A module as a client: one request at a time, whose last answer is kept until it is looked at.
class CamacSession final : public api::Session {
 public:
  explicit CamacSession(std::string name)
      : Session(api::Transport::kCamac, std::move(name), true) {}

  // The number of the request that is made next.
  std::int64_t next_number() {
    answer_.reset();
    return ++number_;
  }
  void answer(std::int64_t number, const api::Reply& reply) override {
    if (number == number_ && api::is_final(reply)) answer_ = reply;
  }
  const std::optional<api::Reply>& last_answer() const { return answer_; }

 private:
  std::int64_t number_ = 0;
  std::optional<api::Reply> answer_;
};

}  // namespace bushd::daemon
