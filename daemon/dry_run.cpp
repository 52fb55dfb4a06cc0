// What a move would be: planned, expanded and packed into frames by the same code as a true one,
// on copies.
#include <algorithm>
#include <cmath>
#include <map>

#include "daemon/bus.h"
#include "daemon/core.h"
#include "tables/move_time.h"

namespace bushd::daemon {
namespace {

// Frames take up to 20 us each, and the loop has to feed motors meanwhile.
constexpr std::uint64_t kMaxFrames = 3000;

struct Rehearsed : AxisSource {
  motion::Axis* moving_axis(link::McuIndex mcu, std::uint8_t motor) override {
    const auto found = axes.find({mcu, motor});
    return found == axes.end() ? nullptr : &found->second;
  }
  std::map<std::pair<link::McuIndex, std::uint8_t>, motion::Axis> axes;
  std::vector<link::PlannedMove> moves;
};

}  // namespace

move_plan_t Core::plan_of(std::int64_t now_us, const command_t& command) const {
  move_plan_t plan{};
  std::map<std::size_t, Rehearsed> buses;
  for (std::size_t i = 0; i < command.motors.size(); ++i) {
    const Motor& motor = motors_[*find_motor(command.motors[i])];
    const Mcu& mcu = mcus_[motor.mcu];
    const std::uint8_t output = motor.config->output.value;
    const std::int64_t steps = target_of(command, i) - motor.position_steps;
    const bushd_table& table = table_of(*motor.config).view();
    const auto time = tables::move_time(table, static_cast<std::uint32_t>(std::abs(steps)));
    plan.motors.push_back(motor.config->name);
    plan.steps.push_back(steps);
    plan.motor_duration_us.push_back(static_cast<std::int64_t>(time.time_ns / 1000));
    plan.peak_steps_per_s.push_back(
        steps == 0 ? 0.0 : 1e9 / (static_cast<double>(time.fastest_code) * table.time_unit_ns));
    if (steps == 0) continue;
    motion::Axis axis = new_axis(*motor.config);
    const link::Tick start = master_of(mcu).earliest_start(now_us, mcu.in_bus, output);
    axis.start(motor.position_steps, steps, start);
    plan.ticks = std::max(plan.ticks, axis.end_tick() - start);
    plan.duration_us =
        std::max(plan.duration_us, (axis.end_tick() - start) * config_.buses[motor.bus].tick_us);
    Rehearsed& bus = buses[motor.bus];
    bus.axes.emplace(std::pair{mcu.in_bus, output}, axis);
    link::PlannedMove move{mcu.in_bus, output, start, {}};
    if (by_table(motor, steps)) move.run_steps = static_cast<std::int32_t>(steps);
    bus.moves.push_back(move);
  }
  for (auto& [index, bus] : buses) {
    const auto traffic = buses_[index]->master.rehearse(now_us, bus, bus.moves, kMaxFrames);
    if (!traffic || plan.frames < 0) {
      plan.frames = plan.bytes = -1;
      continue;
    }
    plan.frames += static_cast<std::int64_t>(traffic->frames);
    plan.bytes += static_cast<std::int64_t>(traffic->bytes);
  }
  plan.motor_count = static_cast<std::int32_t>(plan.motors.size());
  return plan;
}

void Core::dry_run(std::int64_t now_us, const command_t& command) {
  const Client client{command.client_id, command.number};
  for (const std::string& name : command.motors) {
    if (!motors_[*find_motor(name)].axis.busy()) continue;
    answer(client, reply_t::REFUSED, "refused", name + " moves; a dry run is of moves from rest");
    return;
  }
  answer(client, reply_t::ACCEPTED, "", "accepted");
  reply_t reply{};
  reply.plan.push_back(plan_of(now_us, command));
  answer(client, reply_t::RESULT, "done", "nothing has moved", std::move(reply));
}

}  // namespace bushd::daemon
