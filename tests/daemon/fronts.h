// What a front end has around it, with a core made up here: requests reach it once, answers go to
// who asked.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <map>
#include <string>
#include <vector>

#include "daemon/core/request_log.h"
#include "daemon/fronts/publishing.h"
#include "daemon/fronts/reception.h"

namespace bushd::daemon {

inline constexpr std::int64_t kRunOfFronts = 99;

inline bool readable(int fd) {
  pollfd polled{.fd = fd, .events = POLLIN, .revents = 0};
  return ::poll(&polled, 1, 0) > 0;
}

class FrontsTest : public testing::Test {
 protected:
  // What the core does with a request: answers it with its number of this kind.
  void carry_out(const api::Asker& asker, const api::Request& request) {
    carried_out_.emplace_back(api::name_of(request));
    after_.push_back(asker.after_stops);
    who_.push_back(asker.session->text());
    asker.answer(api::Accepted{});
    asker.answer(api::Completed{.outcome = api::Outcome::kDone,
                                .reason = "the " + std::to_string(carried_out_.size()) + ".",
                                .detail = {}});
  }
  // After how many stops each request has arrived, by its name.
  std::map<std::string, std::uint64_t> arrivals() const {
    std::map<std::string, std::uint64_t> after;
    for (std::size_t i = 0; i < after_.size(); ++i) after[carried_out_[i]] = after_[i];
    return after;
  }
  void publish_something() {
    publishing_.publish(McuId{0}, api::StateSnapshot{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(McuId{0}, api::Description{.bus = "hall", .mcu = "hall:1"});
    publishing_.publish(BusId{0}, api::HealthSnapshot{.bus = "hall"});
  }

  static std::int64_t unix_us() { return 1; }

  std::vector<std::string> carried_out_;
  std::vector<std::string> who_;
  std::vector<std::uint64_t> after_;  // how many stops each has arrived
  std::int64_t now_us_ = 1'000'000;
  StopCount stops_;
  Reception reception_{stops_, [this](const api::Asker& asker, const api::Request& request) {
                         carry_out(asker, request);
                       }};
  Publishing publishing_{
      kRunOfFronts, 1, 1, {.now_us = [this] { return now_us_; }, .unix_us = unix_us}};
};

}  // namespace bushd::daemon
