// Clients that nobody wants: they move, stop and set motors as chance has it, send groups, send
// commands again, and talk nonsense.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "bushd/command_t.hpp"
#include "sim/random.h"
#include "witness.h"

namespace bushfaults {

class Clients {
 public:
  Clients(const bushd::config::Config& config, const Witness& witness, std::uint64_t seed);

  // The next command, and how long after it the one after is due.
  bushd::command_t next();
  bushd::sim::TimeNs pause_ns() { return random_.wait(150e6); }
  // Drivers on; everything stops. Before quiet.
  bushd::command_t enable_all() { return make(bushd::command_t::ENABLE); }
  bushd::command_t stop_all() { return make(bushd::command_t::STOP); }
  // A new daemon does not know what was asked of the old one: clients begin anew.
  void begin_anew();

 private:
  struct Choice {
    std::string name;
    std::int64_t position_steps;
    std::int64_t target_steps;
  };
  bushd::command_t make(std::int8_t kind);
  void add(bushd::command_t& command, const std::string& motor, std::int64_t steps);
  bushd::command_t move();
  bushd::command_t retarget();
  bushd::command_t stop();
  bushd::command_t set(const std::vector<Choice>& motors);
  bushd::command_t nonsense();
  std::string any_motor();
  // Motors that the daemon says are at rest (or moving), uncertain (or known).
  std::vector<Choice> motors_that(bool moving, bool uncertain) const;

  static constexpr std::size_t kClients = 4;
  static constexpr std::size_t kRemembered = 30;

  const bushd::config::Config& config_;
  const Witness& witness_;
  bushd::sim::Random random_;
  std::uint64_t generation_ = 0;
  std::vector<std::int64_t> number_;  // by client
  std::deque<bushd::command_t> sent_;
};

}  // namespace bushfaults
