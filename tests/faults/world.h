// All of it in one process and on virtual time: clients, daemon, adapter, line, MCUs, motors, and
// the trouble that comes over them.
//
// Trouble comes in spells of some minutes, each kind at random times of its own; then there is
// calm for some seconds, in which everything must be well again by itself. The last calm is the
// end.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bare_config.h"
#include "clients.h"
#include "config/config.h"
#include "host.h"
#include "inputs.h"
#include "kinds.h"
#include "made_config.h"
#include "mail.h"
#include "overheard.h"
#include "recent.h"
#include "second_daemon.h"
#include "sim/bus.h"
#include "sim/plant.h"
#include "skew.h"
#include "witness.h"

namespace bushfaults {

class BareWorld;

struct Options {
  std::uint64_t seed = 1;
  double hours = 0.1;
  std::size_t motors = 32;
  std::size_t mcus = 2;
  std::size_t absent_mcus = 0;  // of these, the last ones
  std::size_t late_mcus = 0;    // those before the absent ones
  bool strict_known = false;
  Ways ways;
  FaultRates fault_rates = usual_fault_rates();
  CommandRates command_rates = usual_command_rates();
  bool keep_positions = false;
  bool all_kinds = false;  // as it was said
  BareOptions bare;
  std::int64_t crystal_ppm = 50;
};

class World {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // `whole`: `config`, and the controllers without firmware behind it.
  World(const Options& options, bushd::config::Config config, bushd::config::Config whole);
  ~World();

  // Until the end or the first violation.
  void run();

  TimeNs now_ns() const { return now_ns_; }
  const bushd::config::Config& config() const { return config_; }
  const FaultCounts& faults() const { return faults_; }
  const CommandCounts& commands() const { return clients_.sent(); }
  const Skew& skew() const { return skew_; }
  const Witness& witness() const { return witness_; }
  const bushd::sim::Plant& plant() const { return plant_; }
  const BareWorld* bare() const { return bare_.get(); }
  const SecondDaemon::Counts& second_daemons() const { return second_->counts(); }
  const Recent& recent() const { return recent_; }
  // Motors that were asked for what they know after a night without power, by their trust then.
  const std::map<std::string, std::uint64_t>& mornings() const { return mornings_; }

 private:
  void add_mcus();
  void add_motors();
  void allow_programs();
  void spell_of_trouble(TimeNs until_ns);
  void calm();
  void be_well(TimeNs began_ns);
  void advance(TimeNs until_ns);
  void run_until(TimeNs until_ns);
  void strike(FaultKind kind);
  void reset_mcu();
  void take_power_of(std::size_t mcu, TimeNs for_ns);
  void cut_power();
  void disturb_disk();
  void night();
  using Evening = std::vector<std::optional<bushd::api::StateSnapshot>>;
  std::optional<std::string> wrong_morning(const Evening& evening, const std::vector<bool>& dark,
                                           bool of_pc) const;
  void deafen_mcu();
  bool is_up(std::size_t mcu) const;
  void note_fault(FaultKind kind, const std::string& detail);

  Options options_;
  bushd::config::Config config_;
  bushd::config::Config whole_;
  Recent recent_;
  bushd::sim::Plant plant_;
  bushd::sim::Bus bus_;
  Witness witness_;
  Skew skew_;
  Clients clients_;
  std::unique_ptr<BareWorld> bare_;  // null: there are none
  Host host_;
  Mail mail_;
  std::vector<std::unique_ptr<bushd::sim::PaceRules>> rules_;  // by group
  std::vector<bushd::sim::Random> chance_;                     // by fault kind
  std::array<TimeNs, kFaultKinds> next_fault_ns_{};
  std::unique_ptr<Overheard> overheard_;  // once the MCUs are on the bus
  std::unique_ptr<Inputs> inputs_;        // once the MCUs are on the bus
  std::unique_ptr<SecondDaemon> second_;  // once the MCUs are on the bus
  FaultCounts faults_{};
  std::map<std::string, std::uint64_t> mornings_;
  TimeNs now_ns_ = 0;
  TimeNs next_command_ns_ = 0;
  TimeNs mcus_up_ns_ = 0;  // when the last MCU that was reset boots
  TimeNs deadlines_checked_ns_ = 0;
  TimeNs skew_checked_ns_ = 0;
};

}  // namespace bushfaults
