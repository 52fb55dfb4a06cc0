// The daemon without I/O: configuration, bytes, requests and time go in; bytes, answers, snapshots
// and log lines come out. daemon/main.cpp puts ports, front ends and the clock around it;
// simulations put virtual ones. Here the services are only put together: what the daemon can do is
// in daemon/services, one class each.
//
// Not thread-safe; all times are microseconds of one monotonic clock.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "api/session.h"
#include "daemon/core/supervisor.h"
#include "daemon/model/outputs.h"
#include "daemon/services/camac.h"
#include "daemon/services/drivers.h"
#include "daemon/services/dry_run.h"
#include "daemon/services/emergency_stop.h"
#include "daemon/services/health_publisher.h"
#include "daemon/services/holds.h"
#include "daemon/services/homing_queue.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/jogs.h"
#include "daemon/services/journal.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/lines.h"
#include "daemon/services/link_faults.h"
#include "daemon/services/local_inputs.h"
#include "daemon/services/motor_settings.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/pauses.h"
#include "daemon/services/position_compare.h"
#include "daemon/services/positions.h"
#include "daemon/services/programs.h"
#include "daemon/services/pseudo_axes.h"
#include "daemon/services/state_publisher.h"
#include "daemon/services/stops.h"
#include "daemon/services/tables_in_service.h"
#include "daemon/services/trajectories.h"
#include "daemon/services/travels.h"
#include "daemon/services/trigger.h"
#include "daemon/services/waiting_requests.h"
#include "daemon/services/while_connected.h"

namespace bushd::daemon {

class Core {
 public:
  // `config` must be one that config::load accepted; it and `outputs` outlive the core. `master`
  // tells this core from others on the same lines: a number that no other is likely to have.
  Core(const config::Config& config, Outputs& outputs, std::uint16_t master);
  Core(const Core&) = delete;
  Core& operator=(const Core&) = delete;

  // `path`: where, for people.
  void port_opened(std::int64_t now_us, BusId bus, const std::string& path = "");
  void port_lost(std::int64_t now_us, BusId bus, const std::string& cause);
  void receive(std::int64_t now_us, BusId bus, std::span<const std::uint8_t> bytes);
  // Something of the bus has answered since its port was opened.
  bool heard(BusId bus) const { return installation_[bus].heard(); }
  // What the bus's port receives before this time may be left unread until then.
  std::int64_t listen_from_us(BusId bus) const {
    return installation_[bus].master.listen_from_us();
  }
  // To be called soon after the output that ordered it.
  void pulse_status(std::int64_t now_us, BusId bus, const link::PulseStatus& status);

  // An asker who has not been counted (Asker::after_stops) is counted here.
  void request(std::int64_t now_us, const api::Asker& asker, const api::Request& request);
  StopCount& counted_stops() { return open_moves_.precedence().counted(); }

  // Publishes the state as it is now, whether due or not.
  void publish_state(std::int64_t now_us) { state_.publish_all(now_us); }

  // Does what is due, and one slice of what takes long; to be called after every call above and at
  // next_wake_us() at the latest.
  void step(std::int64_t now_us) {
    keep_up(now_us);
    work();
  }
  std::int64_t next_wake_us() const;
  // The two by themselves, for who listens to others in between: what motors and clients wait for,
  // and one slice of large moves or dry runs, far less than a millisecond.
  void keep_up(std::int64_t now_us);
  void work();
  // Slices of that wait.
  bool has_work() const;
  // A large move is being begun in slices: requests that are no stops should wait.
  bool begins_moves() const { return moves_.begins(); }
  // Units of work done so far in slices.
  std::uint64_t units_of_work() const {
    return dry_runs_.units() + moves_.units() + trajectories_.units();
  }

  // Answers to what the outputs were asked, what the daemon has kept from before, and checks.
  TablesInService& tables() {
    state_.look_anew();
    return tables_;
  }
  // The store of positions: its answers, what the daemon has kept from before, and checks.
  KeptPositions& kept() {
    state_.look_anew();
    return kept_;
  }

  // Ramps down all motors and takes no more moves.
  void shut_down(std::int64_t now_us);
  // No motor moves by this core's doing.
  bool at_rest() const { return open_moves_.empty() && homing_.empty() && programs_.at_rest(); }
  // What there is to keep of positions is on the disk.
  bool settled() const { return kept_.settled(); }
  // When all that moves now will have come to rest, as planned.
  std::int64_t rest_by_us(std::int64_t now_us) const { return moves_.rest_by_us(now_us); }

 private:
  void end_overtaken(std::int64_t now_us);
  void carry_out(std::int64_t now_us, const api::Asker& asker, const api::Request& request);
  bool would_take(const api::Request& request) const;

  Outputs& outputs_;
  Installation installation_;
  Interlocks interlocks_;
  OpenMoves open_moves_;
  Journal journal_;
  Positions positions_;
  KeptPositions kept_;
  DryRuns dry_runs_;
  TablesInService tables_;
  Moves moves_;
  IdleDrivers idle_drivers_;
  HomingQueue homing_;
  Travels travels_;
  Programs programs_;
  LocalInputs local_inputs_;
  Stops stops_;
  Jogs jogs_;
  Pauses pauses_;
  Holds holds_;
  Lines lines_;
  Trajectories trajectories_;
  EmergencyStop emergency_stop_;
  LinkFaults link_faults_;
  Drivers drivers_;
  Trigger trigger_;
  WhileConnected while_connected_;
  PositionCompare position_compare_;
  PseudoAxes pseudo_axes_;
  StatePublisher state_;
  LineTables line_tables_;
  LineRoom line_room_;
  WaitingRequests waiting_requests_;
  HealthPublisher health_;
  MotorSettings settings_;
  Camac camac_;
  std::vector<Service*> services_;  // in the order in which they follow what MCUs tell
  Supervisor supervisor_;
  bool trajectories_in_turn_ = false;
};

}  // namespace bushd::daemon
