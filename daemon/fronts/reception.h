// Requests on their way from the front ends to the core: what ends motion at once, the others in
// turn, one client after the other. How many may wait is bounded, per client and in all; what is
// too many is refused. Each is told after how many stops it arrived (precedence.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

#include "api/session.h"
#include "daemon/fronts/arrivals.h"
#include "daemon/model/stop_count.h"

namespace bushd::daemon {

class Reception {
 public:
  // The caller lets requests that wait be carried out for so long, then looks for stops and after
  // the motors again.
  static constexpr std::int64_t kSliceUs = 250;

  struct Limits {
    std::size_t requests_per_client = 64;
    std::size_t bytes_per_client = 512 * 1024;
    std::size_t requests = 4096;
    std::size_t bytes = 8 * 1024 * 1024;
  };
  using CarryOut = std::function<void(const api::Asker&, const api::Request&)>;

  // Never goes back; nobody sets it.
  using Clock = std::function<std::int64_t()>;

  // Both outlive it. `now_us`: for arrivals (arrivals.h); without it time stands still.
  Reception(StopCount& counted, CarryOut carry_out)
      : Reception(counted, std::move(carry_out), Limits()) {}
  Reception(StopCount& counted, CarryOut carry_out, Limits limits, Clock now_us = {})
      : limits_(limits),
        counted_(counted),
        carry_out_(std::move(carry_out)),
        now_us_(std::move(now_us)) {}

  // Carries out what ends motion before it returns. Others wait, or are refused. `bytes`: of its
  // message; `arrival`: when that came, where it may have been read after later ones. An asker who
  // is counted already has not arrived after more stops than that. Precondition: the asker has a
  // session.
  void take(api::Asker asker, api::Request request, std::size_t bytes,
            const std::optional<Arrival>& arrival = {});
  std::uint64_t stops() const { return counted_.stops(); }

  bool idle() const { return turns_.empty(); }
  // Carries out the next one, if there is one.
  void carry_out_next();

  std::size_t requests() const { return requests_; }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Waiting {
    api::Asker asker;
    api::Request request;
    std::size_t bytes;
  };
  struct Client {
    std::deque<Waiting> waiting;
    std::size_t bytes = 0;
  };

  std::int64_t now_us() const { return now_us_ ? now_us_() : 0; }
  bool takes_more(const Client& client, std::size_t bytes) const;

  Limits limits_;
  StopCount& counted_;
  Arrivals arrivals_;
  CarryOut carry_out_;
  Clock now_us_;
  std::unordered_map<std::string, Client> clients_;  // that have something waiting
  std::list<std::string> turns_;                     // the next one first
  std::size_t requests_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace bushd::daemon
