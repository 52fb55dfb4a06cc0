// Clients that nobody wants: they move, stop and set motors as chance has it, send groups, change
// their minds, pull the emergency stop, send commands again, and talk nonsense.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "bushd/command_t.hpp"
#include "kinds.h"
#include "sim/line.h"
#include "sim/random.h"
#include "witness.h"

namespace bushfaults {

class Clients {
 public:
  Clients(const bushd::config::Config& config, const Witness& witness, const CommandRates& rates,
          std::uint64_t seed);

  // The next command, and when the one after it is due.
  bushd::command_t next();
  bushd::sim::TimeNs next_after(bushd::sim::TimeNs now_ns);
  // What only clients can mend: everything stops, drivers on, an emergency is over. Before quiet.
  bushd::command_t stop_all() { return make(bushd::command_t::STOP); }
  bushd::command_t enable_all() { return make(bushd::command_t::ENABLE); }
  bushd::command_t clear_all() { return make(bushd::command_t::CLEAR_FAULTS); }
  // Some MCU stands still after an emergency stop, as far as the daemon has said.
  bool emergency() const { return says("emergency stop"); }

  const CommandCounts& sent() const { return sent_by_kind_; }
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
  bushd::command_t compose(CommandKind kind);
  // Drivers that are off, positions in doubt and emergencies are seen to soon.
  std::optional<bushd::command_t> remedy();
  bool says(const char* detail) const;
  bushd::command_t move(std::size_t motors);
  bushd::command_t retarget();
  bushd::command_t stop();
  bushd::command_t set(const std::vector<Choice>& motors);
  bushd::command_t switch_drivers();
  bushd::command_t nonsense();
  std::string any_motor();
  // Motors that the daemon says are at rest (or moving), uncertain (or known).
  std::vector<Choice> motors_that(bool moving, bool uncertain) const;

  static constexpr std::size_t kClients = 4;
  static constexpr std::size_t kRemembered = 30;

  const bushd::config::Config& config_;
  const Witness& witness_;
  const CommandRates rates_;
  const double per_hour_;  // of all kinds
  bushd::sim::Random random_;
  std::uint64_t generation_ = 0;
  std::vector<std::int64_t> number_;  // by client
  std::deque<bushd::command_t> sent_;
  CommandCounts sent_by_kind_{};
};

}  // namespace bushfaults
