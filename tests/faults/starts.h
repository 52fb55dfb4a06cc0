// Whether motors begin to move when they should: those of one move together, and those that wait
// for the trigger at its edge, three ticks and the delay that was asked for.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "request.h"
#include "sim/edge.h"

namespace bushfaults {

class Starts {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // `config` outlives it.
  explicit Starts(const bushd::config::Config& config)
      : config_(config), edges_(config.mcus.size()) {}

  void trigger(TimeNs now_ns, std::size_t mcu, bool rising);
  // First steps by motor of the request, of those that are known and began at rest. What is wrong,
  // if something is.
  std::optional<std::string> check(const Request& request,
                                   const std::vector<std::optional<TimeNs>>& first_step_ns) const;

 private:
  struct Edge {
    TimeNs time_ns;
    bool rising;
  };
  std::optional<std::string> check_triggered(const Request& request, const std::string& name,
                                             TimeNs first_step_ns) const;

  const bushd::config::Config& config_;
  std::vector<std::deque<Edge>> edges_;  // by MCU, oldest first
};

}  // namespace bushfaults
