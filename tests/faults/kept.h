// What the daemon keeps of its motors, on a disk of the simulation, and the workers that write it:
// each thing takes its time, and its answer is one more input of virtual time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "daemon/core/core.h"
#include "sim/disk/sim_disk.h"
#include "sim/random.h"
#include "sim/wire.h"
#include "state/keeper.h"
#include "state/store.h"

namespace bushfaults {

class Kept final : private bushd::state::Backend {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // `config` outlives it.
  Kept(const bushd::config::Config& config, std::uint64_t seed);

  // A daemon starts, which has told its ports nothing so far. Why it cannot: the disk is broken, or
  // loses power.
  bushd::Result<void> use(TimeNs now_ns, bushd::daemon::Core& core);
  // It is gone: what its workers were at is done or not, as chance has it.
  void end_process();
  // So is the PC. What was not synced is lost, there or torn.
  void cut_power();

  // Does what is due, and tells the daemon.
  void run(TimeNs now_ns, bushd::daemon::Core& core);
  TimeNs next_ns() const;
  bool has_power() const { return disk_.has_power(); }

  // Faults.
  void lose_power_after(std::uint64_t operations) { disk_.lose_power_after(operations); }
  void be_slow(TimeNs each_ns, TimeNs until_ns);
  void be_broken(TimeNs until_ns);
  TimeNs faults_over_ns() const { return std::max(slow_until_ns_, broken_until_ns_); }

  std::uint64_t syncs() const { return disk_.syncs(); }

 private:
  // In one of the two threads. It is done, and a moment later the daemon hears of it.
  struct Job {
    TimeNs due_ns;
    std::function<std::function<void(bushd::daemon::Core&)>()> work;
  };
  using Jobs = std::deque<Job>;
  void mark(std::vector<bushd::state::Mark> marks) override;
  void write(bushd::state::Batch batch) override;
  void history(std::string motor, int most, Told told) override;
  void add(Jobs& jobs, decltype(Job::work) work);
  void heal(TimeNs now_ns);
  void run(TimeNs now_ns, Jobs& jobs, bushd::daemon::Core& core);

  const bushd::config::Config& config_;
  bushd::sim::Random random_;
  bushd::sim::SimDisk disk_;
  std::optional<bushd::state::Store> store_;
  TimeNs now_ns_ = 0;
  Jobs marks_;
  Jobs writes_;
  TimeNs slow_ns_ = 0;  // for each thing
  TimeNs slow_until_ns_ = 0;
  TimeNs broken_until_ns_ = 0;
};

}  // namespace bushfaults
