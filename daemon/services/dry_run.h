// What a move would be: planned, expanded and packed into frames by the same code as a true one, on
// copies. That takes milliseconds for many motors or long moves, so it is done in slices while
// motors and other clients are served; what it is planned from is the state at its acceptance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/session.h"
#include "bus/rs485/rehearsal.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

// One of them.
class DryRun {
 public:
  struct Part {
    MotorId motor;  // at rest; the legs of one motor stand together, in their order
    std::int64_t steps;
    bushd_delay shortest_delay;
    std::optional<std::int64_t> from_steps{};  // none: where it stands
    // The shortest delay is that of its run; all start together.
    std::optional<motion::LineShare> line{};
  };
  // `installation` outlives it, and may change meanwhile.
  // `limited_by` as of MovePlan.
  DryRun(const Installation& installation, std::int64_t now_us, const std::vector<Part>& parts,
         std::string limited_by = {});
  DryRun(const DryRun&) = delete;
  DryRun& operator=(const DryRun&) = delete;

  // Does one unit of work: plans a motor, or makes a frame. Returns false when nothing is left.
  bool step();
  // Precondition: step() has returned false.
  api::MovePlan take_plan() { return std::move(plan_); }

 private:
  struct Motor {
    std::string name;
    BusId bus;
    link::McuIndex mcu;
    Output output;
    std::int64_t from_steps;
    std::int64_t steps;
    bushd_delay shortest_delay;
    link::Tick start;
    bool by_table;
    std::uint32_t tick_ns;
    bushd_format format;
    tables::TablePtr table;
    std::optional<motion::LineShare> line;
    std::optional<link::LineRun> line_run;  // that its MCU is to make itself
  };
  // The motors of one bus.
  struct Bus : AxisSource {
    explicit Bus(std::optional<link::BusSnapshot> of) : snapshot(std::move(of)) {}
    motion::Axis* axis_of(link::McuIndex mcu, Output output) override;

    std::optional<link::BusSnapshot> snapshot;  // none: of a kind whose traffic is not counted
    std::map<std::pair<link::McuIndex, Output>, motion::Axis> axes;
    std::vector<link::PlannedMove> moves;
    std::unique_ptr<link::Rehearsal> rehearsal;  // from when all its motors are planned
  };

  bool is_further_leg(std::size_t index) const;
  void plan_motor(const Motor& motor, bool further_leg);
  bool rehearse(Bus& bus);

  std::vector<Motor> motors_;
  std::map<BusId, Bus> buses_;
  std::size_t planned_ = 0;  // of `motors_`
  struct Time {
    link::Tick ticks = 0;
    std::int64_t us = 0;
  };
  Time of_motor_;  // of the legs of the motor planned last
  std::map<BusId, Bus>::iterator rehearsed_;
  api::MovePlan plan_;
};

// Those that are asked for, one after the other. How many may wait is bounded, per client and in
// all.
class DryRuns {
 public:
  // A unit is up to some tens of microseconds, so that a slice is far less than a millisecond.
  static constexpr unsigned kUnitsPerSlice = 8;
  static constexpr std::size_t kMaxPerClient = 2;
  static constexpr std::size_t kMax = 32;

  explicit DryRuns(const Installation& installation) : installation_(installation) {}

  // Refuses one too many. Precondition: the motors may make these moves.
  void request(std::int64_t now_us, const api::Asker& asker, const std::vector<DryRun::Part>& parts,
               const std::string& limited_by = {});

  bool idle() const { return waiting_.empty(); }
  // One slice of the oldest.
  void work();
  // Units of work done so far.
  std::uint64_t units() const { return units_; }

 private:
  struct Waiting {
    Waiting(api::Asker by, const Installation& installation, std::int64_t now_us,
            const std::vector<DryRun::Part>& parts, const std::string& limited_by)
        : asker(std::move(by)), dry_run(installation, now_us, parts, limited_by) {}
    api::Asker asker;
    DryRun dry_run;
  };
  std::size_t waiting_of(const std::string& client) const;

  const Installation& installation_;
  std::list<Waiting> waiting_;
  std::uint64_t units_ = 0;
};

}  // namespace bushd::daemon
