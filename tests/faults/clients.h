// Clients that nobody wants: they move, stop and set motors as chance has it, send groups, change
// their minds, pull the emergency stop, and talk nonsense. What they say goes by Mail.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "joggers.h"
#include "kinds.h"
#include "mcu_programs.h"
#include "programs.h"
#include "request.h"
#include "sim/random.h"
#include "sim/wire.h"
#include "witness.h"

namespace bushfaults {

class Clients {
 public:
  Clients(const bushd::config::Config& config, const Witness& witness, const CommandRates& rates,
          std::uint64_t seed);

  // The next request, and when the one after it is due. Nothing: one that was sent before, again.
  std::optional<Request> next();
  bushd::sim::TimeNs next_after(bushd::sim::TimeNs now_ns);
  // What only clients can mend: everything stops, drivers on, an emergency is over. Before quiet.
  Request stop_all() { return make(Ask::kStop); }
  Request enable_all() { return of_all_online(Ask::kEnable); }
  Request clear_all() { return of_all_online(Ask::kClearFaults); }
  // What those ask who have begun to jog; before quiet they die.
  // So do those whose trajectory was told; what is left of it comes later.
  std::vector<Request> due(bushd::sim::TimeNs now_ns);
  void let_go() {
    joggers_.die();
    later_.clear();
  }
  // Some MCU stands still after an emergency stop or input, as far as the daemon has said.
  bool emergency() const { return says("emergency"); }

  const CommandCounts& sent() const { return sent_by_kind_; }
  // One request of a flood, by this client of the flood's own.
  Request one_of_flood(std::size_t client);

 private:
  struct Choice {
    std::string name;
    std::int64_t position_steps;
    std::int64_t target_steps;
  };
  Request make(Ask ask);
  // The daemon refuses them if an MCU of theirs is offline.
  Request of_all_online(Ask ask);
  Request compose(CommandKind kind);
  CommandKind choose();
  // Drivers that are off, positions in doubt and emergencies are seen to soon.
  std::optional<Request> remedy();
  bool says(const char* detail) const;
  Request move(std::size_t motors);
  Request retarget();
  Request stop();
  Request set(const std::vector<Choice>& motors);
  Request switch_drivers();
  Request chased();
  Request nonsense();
  Request home();
  Request arm();
  Request disarm();
  Request confirm();
  Request move_of_user();
  Request set_of_user();
  Request move_at_speed();
  Request move_or_retarget();
  Request move_with_legs();
  Request move_along_line();
  void be_elementary(Request& line) const;
  Request arm_line();
  Request jog();
  Request pause_or_hold();
  Request change_settings();
  Request of_program();
  // Some motors at rest without backlash; one, if there are none.
  std::vector<Choice> some_at_rest(std::int64_t most);
  Request move_along_path();
  Request first_of_parts(Request path);
  Request tell_trajectory();
  Request of_some(Ask ask, std::vector<std::string> motors);
  std::vector<std::string> motors_with(bool bushd::api::MotorState::* flag) const;
  std::optional<Request> remedy_of_pauses();
  std::size_t index_of(const std::string& motor) const;
  std::string any_motor();
  // Motors that the daemon says are at rest (or moving), uncertain (or known).
  std::vector<Choice> motors_that(bool moving, bool uncertain) const;

  static constexpr std::size_t kClients = 4;
  static constexpr std::int64_t kFarthestSteps = 20'000;

  const bushd::config::Config& config_;
  const Witness& witness_;
  const CommandRates rates_;
  const double per_hour_;  // of all kinds
  bushd::sim::Random random_;
  Joggers joggers_;
  Programs programs_;
  McuPrograms mcu_programs_;
  std::string shutter_{};                         // name of its motor, if there is one
  mutable bushd::sim::Random random_of_shutter_;  // who moves it beside its programs
  bushd::sim::Random random_of_laws_;             // of lines
  struct Later {
    bushd::sim::TimeNs after_ns;
    bushd::sim::TimeNs due_ns;  // 0: it has only just been thought of
    Request request;
  };
  std::vector<Later> later_;
  std::int64_t trajectories_ = 0;
  std::int64_t parts_ = 0;  // paths told in parts
  CommandCounts sent_by_kind_{};
};

}  // namespace bushfaults
