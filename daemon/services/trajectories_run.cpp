// Motors that follow a trajectory: from its beginning to its end.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/services/trajectories.h"

namespace bushd::daemon {

Result<void> Trajectories::may_run(const Loaded& loaded) const {
  if (loaded.waits) return fail("its rows are still being checked");
  if (loaded.followed) return fail("it runs already");
  if (loaded.rows.known_rows() == 0) return fail("it has too few rows");
  if (const auto may = interlocks_.may_move(); !may) return may;
  for (std::size_t m = 0; m < loaded.parts.size(); ++m) {
    const auto& [id, table, coordinates, bounds] = loaded.parts[m];
    const motion::Motor& motor = installation_[id];
    auto may = interlocks_.may_move(id);
    if (may) may = motor.reach().may_move_to(motor.position_steps());
    if (may && motor.has_plan()) may = fail("it moves; stop it, or wait for its result");
    if (!may) return fail(motor.name() + ": " + may.error().text());
    if (table != installation_.table_of(id) ||
        coordinates.scale() != motor.scale().coordinates().scale() ||
        bounds.lowest != motor.scale().lowest() || bounds.highest != motor.scale().highest()) {
      return fail(motor.name() +
                  ": its table, offset, direction or limits have changed since the trajectory was "
                  "checked; load it again");
    }
    const std::int64_t first = motion::nearest_step(loaded.rows.position(0, m));
    if (motor.position_steps() == first) continue;
    return fail(fmt::format("{} stands at {}, and the trajectory begins at {}; move it there first",
                            motor.name(), coordinates.text(motor.position_steps()),
                            coordinates.text(first)));
  }
  return {};
}

void Trajectories::run(std::int64_t now_us, const api::Asker& asker, const api::Follow& request) {
  const auto found = find(asker, request.array);
  if (found == trajectories_.end()) {
    return asker.answer(api::Refused{"no such trajectory is loaded; tell its rows first"});
  }
  Loaded& loaded = *found;
  loaded.after_stops = std::min(loaded.after_stops, asker.after_stops);
  if (const auto by = overtaken(loaded)) {
    trajectories_.erase(found);
    return open_.not_begun(asker, *by);
  }
  if (const auto may = may_run(loaded); !may) return asker.answer(api::Refused{may.error().text()});
  asker.answer(api::Accepted{});
  loaded.followed = std::make_shared<motion::Trajectory>(loaded.rows);
  loaded.logged = journal_.trajectory_begun();
  journal_.trajectory_rows(loaded.logged, *loaded.followed, loaded.motors());
  const std::vector<MotorId> motors = loaded.motors();
  motion::Tick start = INT64_MIN;
  for (const MotorId id : motors) {
    start = std::max(start,
                     installation_.mcu_of(id).earliest_start(now_us, installation_[id].output()));
  }
  open_.open(asker, motors, OpenMoves::Purpose::kFollow);
  for (std::size_t m = 0; m < motors.size(); ++m) {
    open_.planned(motors[m], 1, loaded.check->peak_steps_per_s(m));
    installation_[motors[m]].follow(
        {.number = loaded.logged.number, .trajectory = loaded.followed, .motor = m}, start);
  }
  moves_.begin_on_line(motors);
}

bool Trajectories::follows(const Loaded& loaded, MotorId motor) const {
  const motion::Motor& of = installation_[motor];
  return motion::follows_trajectory(of) && of.axis().trajectory()->trajectory == loaded.followed;
}

void Trajectories::step(std::int64_t now_us) {
  now_us_ = now_us;
  for (auto it = trajectories_.begin(); it != trajectories_.end();) {
    const bool over = it->followed && !it->waits && !follow(now_us, *it);
    it = over ? trajectories_.erase(it) : std::next(it);
  }
}

// Whatever ends one motor's part before the trajectory ends acts on all. Returns false when none
// follows it any more.
bool Trajectories::follow(std::int64_t now_us, Loaded& loaded) {
  std::vector<MotorId> on;
  std::optional<std::string> off;
  for (const MotorId id : loaded.motors()) {
    const motion::Motor& motor = installation_[id];
    const Mcu& mcu = installation_.mcu_of(id);
    if (!follows(loaded, id)) {
      off = motor.name();
      continue;
    }
    const motion::Moving& moving = *motor.moving();
    const bool ends =
        motor.stops() || moving.limit != 0 || moving.faults != 0 || moving.position_mismatch;
    if (ends) off = motor.name();
    const motion::Tick now = installation_.bus_of(mcu).master.tick_at(now_us);
    if (!ends && motor.axis().trajectory_goes_on_after(now)) on.push_back(id);
  }
  const bool any =
      std::ranges::any_of(loaded.motors(), [&](MotorId id) { return follows(loaded, id); });
  if (!off || on.empty()) return any;
  for (const MotorId id : on) {
    open_.say(id, api::Outcome::kStopped,
              {api::Outcome::kStopped, "ramped down by its table, because " + *off +
                                           " does not follow the trajectory any more"});
  }
  moves_.stop(now_us, on);
  for (const MotorId id : on) installation_[id].is_stopped_by_others();
  return any;
}

}  // namespace bushd::daemon
