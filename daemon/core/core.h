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
#include <tuple>
#include <vector>

#include "api/session.h"
#include "daemon/core/request_log.h"
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
  bool would_take(const api::Request& request);

  // In the order in which they follow what MCUs tell: what an MCU's positions are worth comes
  // before whoever goes by that. A request is carried out by the one that has a function request()
  // for it.
  auto services() {
    return std::tie(kept_, idle_drivers_, journal_, moves_, homing_, link_faults_, local_inputs_,
                    programs_, stops_, emergency_stop_, drivers_, positions_, trigger_,
                    while_connected_, position_compare_, tables_, waiting_requests_, jogs_, pauses_,
                    holds_, lines_, settings_, travels_, camac_, trajectories_);
  }
  std::vector<Service*> all_services();

  Outputs& outputs_;
  Installation installation_;
  Interlocks interlocks_{installation_};
  OpenMoves open_moves_{installation_};
  Journal journal_{installation_, outputs_};
  Positions positions_{installation_, interlocks_, journal_, outputs_};
  KeptPositions kept_{installation_, positions_, journal_, outputs_};
  DryRuns dry_runs_{installation_};
  TablesInService tables_{installation_, interlocks_, outputs_};
  Moves moves_{installation_, interlocks_, journal_, open_moves_, dry_runs_, outputs_};
  IdleDrivers idle_drivers_{installation_, outputs_,
                            [this](MotorId motor) { return waiting_requests_.holds(motor); }};
  HomingQueue homing_{installation_, interlocks_,   open_moves_, moves_,
                      kept_,         idle_drivers_, outputs_};
  Travels travels_{installation_, interlocks_, open_moves_, kept_, idle_drivers_, outputs_};
  Programs programs_{installation_, interlocks_, open_moves_, kept_, idle_drivers_, outputs_};
  LocalInputs local_inputs_{installation_};
  Stops stops_{installation_, moves_, homing_, travels_, programs_, local_inputs_, open_moves_};
  Jogs jogs_{installation_, interlocks_, moves_, open_moves_};
  Pauses pauses_{installation_, interlocks_, moves_, programs_, open_moves_};
  Holds holds_{installation_, interlocks_, moves_, local_inputs_, open_moves_, kept_, outputs_};
  Lines lines_{installation_, interlocks_, journal_, moves_, open_moves_, dry_runs_};
  Trajectories trajectories_{installation_, interlocks_, journal_, moves_, open_moves_};
  EmergencyStop emergency_stop_{installation_, interlocks_, homing_, open_moves_, kept_, outputs_};
  LinkFaults link_faults_{installation_, emergency_stop_, outputs_};
  Drivers drivers_{installation_, interlocks_, emergency_stop_};
  Trigger trigger_{installation_, interlocks_, moves_, open_moves_};
  WhileConnected while_connected_{installation_, moves_, open_moves_};
  PositionCompare position_compare_{installation_};
  PseudoAxes pseudo_axes_{installation_};
  StatePublisher state_{installation_, pseudo_axes_, open_moves_,
                        [this](McuId mcu) { return programs_.text(mcu); }, outputs_};
  LineTables line_tables_{installation_, lines_};
  LineRoom line_room_{installation_};
  WaitingRequests waiting_requests_{
      installation_,
      interlocks_,
      open_moves_,
      kept_,
      idle_drivers_,
      line_tables_,
      line_room_,
      [this](std::int64_t now_us, const api::Asker& asker, const api::Request& request) {
        carry_out(now_us, asker, request);
      },
      [this] { return moves_.begins(); },
      [this](const api::Request& request) { return would_take(request); }};
  HealthPublisher health_{installation_, outputs_};
  MotorSettings settings_{
      installation_, positions_, kept_,
      journal_,      outputs_,   [this](MotorId motor) { return waiting_requests_.holds(motor); }};
  Camac camac_{installation_,
               interlocks_,
               open_moves_,
               tables_,
               lines_,
               travels_,
               programs_,
               kept_,
               outputs_,
               [this](std::int64_t now_us, const api::Asker& asker, const api::Request& request) {
                 this->request(now_us, logged(asker, request, outputs_), request);
               }};
  std::vector<Service*> services_ = all_services();
  Supervisor supervisor_{installation_, journal_,        moves_,    positions_,
                         kept_,         emergency_stop_, services_, outputs_};
  bool trajectories_in_turn_ = false;
};

}  // namespace bushd::daemon
