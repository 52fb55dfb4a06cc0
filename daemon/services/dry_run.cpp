#include "daemon/services/dry_run.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <utility>

#include "tables/move_time.h"

namespace bushd::daemon {
namespace {

// Frames take up to 20 us each, and the loop has to feed motors meanwhile.
constexpr std::uint64_t kMaxFrames = 3000;

// The motors of one bus.
struct Rehearsed : AxisSource {
  motion::Axis* axis_of(link::McuIndex mcu, Output output) override {
    const auto found = axes.find({mcu, output});
    return found == axes.end() ? nullptr : &found->second;
  }
  std::map<std::pair<link::McuIndex, Output>, motion::Axis> axes;
  std::vector<link::PlannedMove> moves;
};

api::MovePlan::Motor plan_of(const std::string& name, const bushd_table& table,
                             std::int64_t steps) {
  const auto time = tables::move_time(table, static_cast<std::uint32_t>(std::abs(steps)));
  return {
      .motor = name,
      .steps = steps,
      .duration_us = static_cast<std::int64_t>(time.time_ns / 1000),
      .peak_steps_per_s =
          steps == 0 ? 0.0 : 1e9 / (static_cast<double>(time.fastest_code) * table.time_unit_ns)};
}

}  // namespace

api::MovePlan DryRun::plan(std::int64_t now_us, const std::vector<Part>& parts) const {
  api::MovePlan plan;
  std::map<BusId, Rehearsed> buses;
  for (const auto& [id, steps] : parts) {
    const motion::Motor& motor = installation_[id];
    const Mcu& mcu = installation_.mcu_of(id);
    const config::Bus& bus = installation_.bus_of(mcu).config;
    plan.motors.push_back(plan_of(motor.name(), installation_.table_of(id)->view(), steps));
    if (steps == 0) continue;
    motion::Axis axis = installation_.new_axis(id);
    const link::Tick start = mcu.earliest_start(now_us, motor.output());
    axis.start(motor.position_steps(), steps, start);
    plan.ticks = std::max(plan.ticks, axis.end_tick() - start);
    plan.duration_us = std::max(plan.duration_us, (axis.end_tick() - start) * bus.tick_us);
    Rehearsed& rehearsed = buses[mcu.config.bus];
    rehearsed.axes.emplace(std::pair{mcu.on_bus(), motor.output()}, axis);
    link::PlannedMove move{mcu.on_bus(), motor.output().value, start, {}};
    if (installation_.by_table(mcu, steps)) move.run_steps = static_cast<std::int32_t>(steps);
    rehearsed.moves.push_back(move);
  }
  plan.traffic.emplace();
  for (auto& [id, bus] : buses) {
    const auto traffic = installation_[id].master.rehearse(now_us, bus, bus.moves, kMaxFrames);
    if (!traffic) {
      plan.traffic.reset();
      break;
    }
    plan.traffic->frames += static_cast<std::int64_t>(traffic->frames);
    plan.traffic->bytes += static_cast<std::int64_t>(traffic->bytes);
  }
  return plan;
}

}  // namespace bushd::daemon
