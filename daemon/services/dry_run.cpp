#include "daemon/services/dry_run.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "tables/move_time.h"

namespace bushd::daemon {
namespace {

constexpr std::uint64_t kMaxFrames = 3000;

api::MovePlan::Motor plan_of(const std::string& name, bushd_table table, std::int64_t steps,
                             bushd_delay shortest_delay) {
  if (!bushd_delay_is_code(shortest_delay)) {  // the delay of all
    const double delay_s = static_cast<double>(shortest_delay) * table.time_unit_ns * 1e-9;
    const double all_us = delay_s * 1e6 * static_cast<double>(std::abs(steps));
    return {.motor = name,
            .steps = steps,
            .duration_us = static_cast<std::int64_t>(all_us),
            .peak_steps_per_s = steps == 0 ? 0.0 : 1 / delay_s};
  }
  table.cruise =
      std::max(table.cruise, static_cast<std::uint16_t>(shortest_delay));  // the same move
  const auto time = tables::move_time(table, static_cast<std::uint32_t>(std::abs(steps)));
  return {
      .motor = name,
      .steps = steps,
      .duration_us = static_cast<std::int64_t>(time.time_ns / 1000),
      .peak_steps_per_s =
          steps == 0 ? 0.0 : 1e9 / (static_cast<double>(time.fastest_code) * table.time_unit_ns)};
}

// As long as the run, which is as fast as its share of it.
api::MovePlan::Motor plan_of_line(const std::string& name, const motion::LineShare& share,
                                  std::int64_t steps, bushd_delay shortest_delay) {
  if (share.track) {
    const motion::Path& path = share.track->path();
    const double ns = static_cast<double>(share.track->units()) * path.unit_ns();
    return {.motor = name,
            .steps = steps,
            .duration_us = static_cast<std::int64_t>(ns / 1000),
            .peak_steps_per_s = path.most_steps_per_s(share.motor)};
  }
  api::MovePlan::Motor plan = plan_of(name, share.table->view(), share.longest, shortest_delay);
  plan.steps = steps;
  plan.peak_steps_per_s *= static_cast<double>(share.increment) / share.longest;
  return plan;
}

// A path may lead back to where it began.
bool makes_steps(std::int64_t steps, const std::optional<motion::LineShare>& line) {
  return steps != 0 ||
         (line && line->track && line->track->path().most_steps_per_s(line->motor) > 0);
}

}  // namespace

motion::Axis* DryRun::Bus::axis_of(link::McuIndex mcu, Output output) {
  const auto found = axes.find({mcu, output});
  return found == axes.end() ? nullptr : &found->second;
}

DryRun::DryRun(const Installation& installation, std::int64_t now_us,
               const std::vector<Part>& parts, std::string limited_by) {
  plan_.limited_by = std::move(limited_by);
  motors_.reserve(parts.size());
  link::Tick of_lines = INT64_MIN;
  for (const auto& [id, steps, shortest_delay, from_steps, line] : parts) {
    const motion::Motor& motor = installation[id];
    const Mcu& mcu = installation.mcu_of(id);
    const config::Bus& bus = installation.bus_of(mcu).config;
    motors_.push_back({.name = motor.name(),
                       .bus = mcu.config.bus,
                       .mcu = mcu.on_bus(),
                       .output = motor.output(),
                       .from_steps = from_steps.value_or(motor.position_steps()),
                       .steps = steps,
                       .shortest_delay = shortest_delay,
                       .start = mcu.earliest_start(now_us, motor.output()),
                       .by_table = !line && installation.by_table(mcu, steps, shortest_delay),
                       .tick_ns = bus.tick_ns(),
                       .format = bus.format,
                       .table = installation.table_of(id),
                       .line = line,
                       .line_run = {}});
    if (line && line->in_mcus) {
      motion::Axis axis = installation.new_axis(id);
      axis.start_line(motors_.back().from_steps, *line, motors_.back().start, shortest_delay);
      motors_.back().line_run = mcu.line_run(axis);
    }
    if (line) of_lines = std::max(of_lines, motors_.back().start);
    if (!makes_steps(steps, line) || buses_.contains(mcu.config.bus)) continue;
    const link::SharedLine* shared = mcu.offers.shared_line;
    buses_.try_emplace(mcu.config.bus,
                       shared != nullptr ? std::optional(shared->snapshot(now_us)) : std::nullopt);
  }
  if (!parts.empty() && parts.front().line && parts.front().line->track) {
    const motion::Path& path = parts.front().line->track->path();
    const std::vector<std::uint64_t> units = path.units_at_points();
    for (std::size_t i = 0; i < units.size() && units.size() <= api::MovePlan::kMostPoints; ++i) {
      const double ns = static_cast<double>(units[i]) * path.unit_ns();
      plan_.points_us.push_back(static_cast<std::int64_t>(ns / 1000));
    }
  }
  for (Motor& motor : motors_) motor.start = std::max(motor.start, of_lines);
  rehearsed_ = buses_.begin();
  plan_.traffic.emplace();
}

bool DryRun::step() {
  if (planned_ < motors_.size()) {
    plan_motor(motors_[planned_], is_further_leg(planned_));
    if (++planned_ == motors_.size() && !plan_.traffic) rehearsed_ = buses_.end();
  } else if (rehearsed_ != buses_.end() && !rehearse(rehearsed_->second)) {
    // If one bus is too much to be counted, so are all.
    rehearsed_ = plan_.traffic ? std::next(rehearsed_) : buses_.end();
  }
  return planned_ < motors_.size() || rehearsed_ != buses_.end();
}

bool DryRun::is_further_leg(std::size_t index) const {
  if (index == 0) return false;
  const Motor& before = motors_[index - 1];
  const Motor& motor = motors_[index];
  return before.bus == motor.bus && before.mcu == motor.mcu && before.output == motor.output;
}

void DryRun::plan_motor(const Motor& motor, bool further_leg) {
  if (!further_leg) of_motor_ = {};
  plan_.motors.push_back(
      motor.line ? plan_of_line(motor.name, *motor.line, motor.steps, motor.shortest_delay)
                 : plan_of(motor.name, motor.table->view(), motor.steps, motor.shortest_delay));
  if (!makes_steps(motor.steps, motor.line)) return;
  motion::Axis axis(motor.table->view(), motor.tick_ns, motor.format);
  if (motor.line) {
    axis.start_line(motor.from_steps, *motor.line, motor.start, motor.shortest_delay);
  } else {
    axis.start(motor.from_steps, motor.steps, motor.start, 0, motor.shortest_delay);
  }
  const link::Tick ticks = axis.end_tick() - motor.start;
  of_motor_.ticks += ticks;
  of_motor_.us += ticks * motor.tick_ns / 1000;
  plan_.ticks = std::max(plan_.ticks, of_motor_.ticks);
  plan_.duration_us = std::max(plan_.duration_us, of_motor_.us);
  if (further_leg) {
    plan_.traffic.reset();  // a rehearsal is of one run per motor
    return;
  }
  Bus& bus = buses_.at(motor.bus);
  bus.axes.emplace(std::pair{motor.mcu, motor.output}, axis);
  link::PlannedMove move{motor.mcu, motor.output.value, motor.start, {}};
  if (motor.by_table) {
    move.run = link::TableRun{static_cast<std::int32_t>(motor.steps), motor.shortest_delay};
  }
  if (motor.line_run) move.run = *motor.line_run;
  bus.moves.push_back(move);
}

// Returns false when all frames of the bus are counted, or too many, or cannot be.
bool DryRun::rehearse(Bus& bus) {
  if (!bus.snapshot) {
    plan_.traffic.reset();
    return false;
  }
  if (!bus.rehearsal) {
    bus.rehearsal =
        std::make_unique<link::Rehearsal>(std::move(*bus.snapshot), bus, bus.moves, kMaxFrames);
    return true;
  }
  if (bus.rehearsal->step()) return true;
  if (const auto& traffic = bus.rehearsal->traffic()) {
    plan_.traffic->frames += static_cast<std::int64_t>(traffic->frames);
    plan_.traffic->bytes += static_cast<std::int64_t>(traffic->bytes);
  } else {
    plan_.traffic.reset();
  }
  return false;
}

std::size_t DryRuns::waiting_of(const std::string& client) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      waiting_, [&](const Waiting& one) { return one.asker.session->text() == client; }));
}

void DryRuns::request(std::int64_t now_us, const api::Asker& asker,
                      const std::vector<DryRun::Part>& parts, const std::string& limited_by) {
  if (const std::size_t count = waiting_of(asker.session->text()); count >= kMaxPerClient) {
    return asker.answer(api::Refused{std::to_string(count) +
                                     " dry runs of this client wait already; wait for answers"});
  }
  if (waiting_.size() >= kMax) {
    return asker.answer(api::Refused{std::to_string(waiting_.size()) +
                                     " dry runs wait already; try again in a moment"});
  }
  asker.answer(api::Accepted{});
  waiting_.emplace_back(asker, installation_, now_us, parts, limited_by);
}

void DryRuns::work() {
  if (waiting_.empty()) return;
  Waiting& oldest = waiting_.front();
  for (unsigned i = 0; i < kUnitsPerSlice; ++i) {
    ++units_;
    if (oldest.dry_run.step()) continue;
    oldest.asker.answer(
        api::Completed{.outcome = api::Outcome::kDone,
                       .reason = "nothing has moved; planned from the state at its acceptance",
                       .detail = oldest.dry_run.take_plan()});
    waiting_.pop_front();
    return;
  }
}

}  // namespace bushd::daemon
