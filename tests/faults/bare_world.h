// Controllers without firmware in the world of bushfaults: their ports, who asks for moves and
// presses keys, the faults that come over them, and their judge. The daemon is that of the others.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bare_config.h"
#include "bare_judge.h"
#include "bare_ports.h"
#include "daemon/fronts/keypad.h"
#include "daemon_run.h"
#include "recent.h"
#include "sim/random.h"

namespace bushfaults {

class BareWorld {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // `config`, of all, outlives it; the first of these controllers is the bus `first_bus`.
  BareWorld(const bushd::config::Config& config, std::size_t first_bus, const BareOptions& options,
            std::uint64_t seed, bool keeps, Recent& recent, BareJudge::Violated violated);
  ~BareWorld();

  // --- The daemon's

  bool has(bushd::BusId bus) const { return bus.value >= first_bus_; }
  bool has(bushd::McuId mcu) const { return mcu.value >= first_mcu_; }
  // Whether a line of the log of moves is about one of these motors.
  bool has(const std::string& json_line) const;
  void send(TimeNs now_ns, bushd::BusId bus, std::span<const std::uint8_t> bytes);
  void pulse(TimeNs now_ns, bushd::BusId bus, const bushd::link::PulseOrder& order);
  void state(TimeNs now_ns, const bushd::api::StateSnapshot& state) { judge_.state(now_ns, state); }
  // Those of its own clients are answered through this.
  std::optional<bushd::api::Asker> hear(TimeNs now_ns, const bushd::api::Asker& asker,
                                        const bushd::api::Request& request);

  void daemon_started(TimeNs now_ns, DaemonRun& daemon);
  // `power`: the computer has lost it.
  // It is asked to.
  void daemon_ends(TimeNs now_ns) { judge_.asked_by_others(now_ns, bushd::api::Stop{}); }
  void daemon_gone(TimeNs now_ns, bool power);
  void daemon_paused(TimeNs until_ns);
  // Time passes at the other ends.
  void advance_to(TimeNs now_ns);
  // Something is to be told to the daemon.
  bool due(TimeNs now_ns) const;
  void tell(TimeNs now_ns, DaemonRun& daemon);
  // What its last step has ordered.
  void answer_orders(TimeNs now_ns, DaemonRun& daemon);

  // --- The world's

  // Trouble comes from now on, or none any more: what is under way passes.
  void trouble(bool comes) { trouble_ = comes; }
  TimeNs faults_over_ns() const;
  void let_go(TimeNs now_ns);
  // What it takes to be well again; nothing: all is.
  std::optional<std::string> not_ready() const;
  void clear_faults() { clears_ = true; }
  bool any_open() const { return judge_.any_open(); }
  std::string open_text() const { return judge_.open_text(); }

  const BareJudge& judge() const { return judge_; }
  const std::map<std::string, std::uint64_t>& faults() const { return faults_; }
  std::uint64_t keys() const { return keys_; }

 private:
  class Desk;
  struct Port {
    std::size_t bus;
    std::size_t mcu;
    std::vector<std::size_t> motors;
    std::unique_ptr<PulsePort> pulses{};
    std::unique_ptr<BoardPort> board{};
    std::optional<bushd::link::PulseStatus> status{};
    bool plugged = true;
    bool told = true;  // the daemon knows whether it is
    TimeNs back_ns = 0;
    TimeNs lines_until_ns = 0;  // limit switches are pressed
  };
  struct Pad {
    std::size_t motor;
    const bushd::config::Keypad* config;
    KeypadBox box;
    std::unique_ptr<bushd::daemon::Keypad> keypad{};
    bool plugged = true;
    TimeNs back_ns = 0;
    TimeNs next_ns = 0;  // a key
  };

  std::size_t pick_motor() {
    return first_motor_ + random_.below(config_.motors.size() - first_motor_);
  }
  void fault(TimeNs now_ns, const std::string& what, const std::string& of);
  void disturb(TimeNs now_ns);
  void disturb_pulses(TimeNs now_ns, Port& port);
  void disturb_board(TimeNs now_ns, Port& port);
  void disturb_keypad(TimeNs now_ns, Pad& pad);
  void unplug(TimeNs now_ns, Port& port, TimeNs for_ns);
  void ask(TimeNs now_ns, DaemonRun& daemon);
  void ask_for(DaemonRun& daemon, const bushd::api::Request& request);
  bushd::api::Request next_request();
  bushd::api::Request next_move(std::size_t motor);
  void press_keys(TimeNs now_ns, Pad& pad);
  void tell(TimeNs now_ns, DaemonRun& daemon, Port& port);
  void tell(TimeNs now_ns, Pad& pad);
  void open_keypad(Pad& pad, DaemonRun& daemon);
  void note_keys(TimeNs now_ns, Pad& pad, std::span<const std::uint8_t> bytes);
  const std::string& name(std::size_t motor) const { return config_.motors[motor].name; }

  const bushd::config::Config& config_;
  const std::size_t first_bus_;
  std::size_t first_mcu_ = 0;
  std::size_t first_motor_ = 0;
  const BareOptions options_;
  Recent& recent_;
  bushd::sim::Random random_;
  bushd::sim::Random chance_;
  BareJudge judge_;
  std::vector<Port> ports_;
  std::vector<Pad> pads_;
  std::shared_ptr<Desk> desk_;
  TimeNs now_ns_ = 0;
  TimeNs next_fault_ns_ = 0;
  TimeNs next_ask_ns_ = 0;
  bool trouble_ = false;
  bool clears_ = false;
  bool emergency_ = false;
  std::map<std::size_t, TimeNs> resume_ns_;  // motors that are paused
  std::map<std::string, std::uint64_t> faults_;
  std::uint64_t keys_ = 0;
};

}  // namespace bushfaults
