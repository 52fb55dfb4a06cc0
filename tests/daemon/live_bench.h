// A bench (bench.h) with simulated MCUs that run the firmware core, and what a service needs of
// others: motors that follow their MCUs' reports, moves, homing and stops. Time moves in run_*()
// only. lab.h has the daemon as a whole.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "daemon/bench.h"
#include "daemon/core/supervisor.h"
#include "daemon/model/interlocks.h"
#include "daemon/services/emergency_stop.h"
#include "daemon/services/homing_queue.h"
#include "daemon/services/journal.h"
#include "daemon/services/local_inputs.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/positions.h"
#include "daemon/services/programs.h"
#include "daemon/services/travels.h"
#include "sim/bus.h"

namespace bushd::test {

// As hall(2, 2); the first MCU has an emergency input.
inline std::string hall_with_emergency_input() {
  return with_mcu_keys(hall(2, 2), "emergency_input = \"ramp\"\n");
}

class LiveBench : public Bench {
 public:
  explicit LiveBench(const std::string& toml = hall(2, 2));
  ~LiveBench() override;

  // All MCUs go online; `service` is told of whatever happens from the beginning.
  void connect(daemon::Service& service);
  bool all_online() const;

  bool run_until(const std::function<bool()>& done, double limit_s = 20);
  void run_for(double seconds);

  std::vector<api::Reply> replies(std::int64_t number) const;
  std::string refusal(std::int64_t number) const;
  bool is_completed(std::int64_t number) const;
  // Runs until the request, which was accepted, has its one result.
  api::Completed result(std::int64_t number);

  void move(std::int64_t number, const std::string& motor, std::int64_t steps);
  const motion::Motor& of(const std::string& name) const { return installation[motor(name)]; }
  const bushd_report& report_of(const std::string& name) const;
  std::int64_t shaft_steps(const std::string& name) const;
  std::int64_t now_us() const { return now_ns_ / 1000; }

  void send(BusId, std::span<const std::uint8_t> bytes) override;

  static constexpr BusId kBus{0};
  sim::Bus line;
  bool silent = false;  // nothing gets through, either way
  daemon::Interlocks interlocks{installation};
  daemon::OpenMoves open_moves{installation};
  daemon::Journal journal{installation, *this};
  daemon::Positions positions{installation, interlocks, journal, *this};
  daemon::KeptPositions kept{installation, positions, journal, *this};
  daemon::DryRuns dry_runs{installation};
  daemon::Moves moves{installation, interlocks, journal, open_moves, dry_runs, *this};
  daemon::IdleDrivers idle_drivers{installation, *this, [](MotorId) { return false; }};
  daemon::HomingQueue homing{installation, interlocks,   open_moves, moves,
                             kept,         idle_drivers, *this};
  daemon::Travels travels{installation, interlocks, open_moves, kept, idle_drivers, *this};
  daemon::Programs programs{installation, interlocks, open_moves, kept, idle_drivers, *this};
  daemon::LocalInputs local_inputs{installation};
  daemon::EmergencyStop emergency_stop{installation, interlocks, homing, open_moves, kept, *this};

 private:
  void advance();

  std::optional<daemon::Supervisor> supervisor_;
  daemon::Service* service_ = nullptr;
  std::vector<std::uint8_t> received_;
  sim::TimeNs now_ns_ = 0;
};

}  // namespace bushd::test
