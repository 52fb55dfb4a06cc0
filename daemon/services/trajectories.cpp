#include "daemon/services/trajectories.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace bushd::daemon {
namespace {

using motion::Trajectory;
using motion::TrajectoryCheck;

// Ticks of all motors together; each takes some 100 ns.
constexpr unsigned kTicksPerSlice = 2000;
// Times that were found to be long enough for each step by itself are mostly so for all of them.
constexpr int kMostTries = 6;
constexpr double kLongestS = 1e8;

std::string client_of(const api::Asker& asker) {
  return asker.session ? asker.session->text() : "";
}

}  // namespace

std::vector<MotorId> Trajectories::Loaded::motors() const {
  std::vector<MotorId> motors;
  for (const Part& part : parts) motors.push_back(part.motor);
  return motors;
}

void Trajectories::request(std::int64_t now_us, const api::Asker& asker,
                           const api::Follow& request) {
  if (request.part == api::Follow::Part::kRun) return run(now_us, asker, request);
  take_rows(now_us, asker, request);
}

std::optional<Precedence::Overtaken> Trajectories::overtaken(const Loaded& loaded) const {
  if (loaded.followed) return std::nullopt;
  return open_.precedence().overtaken(loaded.after_stops, loaded.motors());
}

void Trajectories::end_overtaken(std::int64_t) {
  std::erase_if(jobs_, [this](const Job& job) {
    Loaded& loaded = *job.trajectory;
    const auto by = overtaken(loaded);
    if (!by) return false;
    loaded.waits = false;
    loaded.spoilt = true;
    loaded.dropped = loaded.rows.closed();
    open_.not_begun(job.asker, *by);
    return true;
  });
}

auto Trajectories::find(const api::Asker& asker, std::int64_t number) -> Place {
  return std::ranges::find_if(trajectories_, [&](const Loaded& loaded) {
    return loaded.number == number && loaded.client == client_of(asker);
  });
}

auto Trajectories::begin(const api::Asker& asker, const api::Follow& request) -> Result<Place> {
  const auto motors = installation_.find(request.motors);
  if (!motors) return fail(motors.error());
  if (motors->size() > api::MoveLine::kMotors.most) {
    return fail(fmt::format("{} motors are named; a trajectory has at most {}", motors->size(),
                            api::MoveLine::kMotors.most));
  }
  if (!api::Follow::kStretch.has(request.stretch)) {
    return fail(fmt::format("times stretched by {}; allowed: {} to {}", request.stretch,
                            api::Follow::kStretch.least, api::Follow::kStretch.most));
  }
  Loaded loaded{
      .client = client_of(asker),
      .number = request.array,
      .parts = {},
      .stretch_thousandths = std::llround(request.stretch * 1000),
      .rows = Trajectory(motors->size(), request.cubic ? Trajectory::Interpolation::kCubic
                                                       : Trajectory::Interpolation::kLinear),
      .check = {},
      .followed = {}};
  const McuId first = installation_.config()[motors->front()].mcu;
  for (const MotorId id : *motors) {
    const motion::Motor& motor = installation_[id];
    const Mcu& mcu = installation_.mcu_of(id);
    if (mcu.config.bus != installation_[first].config.bus) {
      return fail(
          fmt::format("{} and {} are on two buses, whose ticks are not in step; motors of a "
                      "trajectory must be on one. Follow two trajectories, or connect their MCUs "
                      "to one bus",
                      installation_[motors->front()].name(), motor.name()));
    }
    if (!mcu.offers.streams) {
      return fail(
          fmt::format("{} is on bus {}, which makes runs of tables only and cannot follow a "
                      "trajectory; move it from point to point",
                      motor.name(), installation_.bus_of(mcu).config.name));
    }
    const auto shortest_delay = moves_.shortest_delay_of(id, std::nullopt);
    if (!shortest_delay) return fail(shortest_delay.error());
    const tables::TablePtr table = installation_.table_of(id);
    loaded.parts.push_back({.motor = id,
                            .table = table,
                            .coordinates = motor.scale().coordinates(),
                            .bounds = {.table = &table->view(),
                                       .shortest_delay = *shortest_delay,
                                       .lowest = motor.scale().lowest(),
                                       .highest = motor.scale().highest()}});
  }
  const auto idle = [](const Loaded& one) { return !one.followed && !one.waits; };
  if (std::ranges::count_if(trajectories_, idle) >= static_cast<std::ptrdiff_t>(kMostLoaded)) {
    trajectories_.erase(std::ranges::find_if(trajectories_, idle));
  }
  if (trajectories_.size() >= 4 * kMostLoaded) {
    return fail(fmt::format("{} trajectories run or are being checked; wait for one of them",
                            trajectories_.size()));
  }
  return trajectories_.insert(trajectories_.end(), std::move(loaded));
}

Result<void> Trajectories::may_go_on(const Loaded& loaded, const api::Follow& request) const {
  if (loaded.waits) return fail("rows that came before are still being checked");
  if (loaded.spoilt) return fail("rows that came before cannot be followed; no more are taken");
  if (loaded.rows.closed()) return fail("the trajectory has its last row already");
  const bool cubic = loaded.rows.interpolation() == Trajectory::Interpolation::kCubic;
  const auto motors = installation_.find(request.motors);
  if (!motors || *motors != loaded.motors() || cubic != request.cubic ||
      loaded.stretch_thousandths != std::llround(request.stretch * 1000)) {
    return fail("its motors, its interpolation and its stretch are those of its first rows");
  }
  return {};
}

// One of its motors that does not follow it any more, once it runs.
std::optional<MotorId> Trajectories::no_more(const Loaded& loaded) const {
  if (!loaded.followed) return std::nullopt;
  for (const MotorId id : loaded.motors()) {
    if (!follows(loaded, id) || installation_[id].stops()) return id;
  }
  return std::nullopt;
}

// A stop since these rows were sent has ended the motion of the trajectory that they are of.
std::optional<api::Reply> Trajectories::stopped(const api::Asker& asker,
                                                const Loaded& loaded) const {
  const auto off = no_more(loaded);
  const auto by =
      off ? open_.precedence().overtaken(asker.after_stops, loaded.motors()) : std::nullopt;
  if (!by) return std::nullopt;
  return api::Completed{.outcome = api::Outcome::kStopped,
                        .reason = installation_[*off].name() +
                                  " does not follow the trajectory any more; " +
                                  installation_[by->motor].name() + " was stopped by " + by->by,
                        .detail = {}};
}

// What has been sent to an MCU cannot be changed any more.
Result<void> Trajectories::has_time(std::int64_t now_us, const Loaded& loaded) const {
  if (!loaded.followed) return {};
  if (const auto off = no_more(loaded)) {
    return fail(installation_[*off].name() + " does not follow the trajectory any more");
  }
  for (const MotorId id : loaded.motors()) {
    const Mcu& mcu = installation_.mcu_of(id);
    const motion::Tick queued = mcu.earliest_start(now_us, installation_[id].output());
    if (installation_[id].axis().runs_out_before(queued)) {
      return fail(fmt::format(
          "the rows come too late: those before end in less than half a second, and have been "
          "sent; {} ramps down after them",
          installation_[id].name()));
    }
  }
  return {};
}

Result<void> Trajectories::take(Loaded& loaded, const api::Follow& request) const {
  const std::size_t motors = loaded.parts.size();
  const std::size_t rows = request.time_s.size();
  if (request.positions.size() != rows * motors) {
    return fail(fmt::format("{} positions are told for {} rows of {} motors",
                            request.positions.size(), rows, motors));
  }
  const std::size_t all = loaded.rows.rows() + rows;
  if (all > api::Follow::kMostRows || all * motors > api::Follow::kMostNumbers) {
    return fail(
        fmt::format("{} rows of {} motors; a trajectory has at most {} rows and {} positions", all,
                    motors, api::Follow::kMostRows, api::Follow::kMostNumbers));
  }
  std::vector<Trajectory::Position> positions(motors);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t number = loaded.rows.rows() + 1;
    const double time_s = request.time_s[row];
    if (!(std::abs(time_s) <= kLongestS)) {
      return fail(
          fmt::format("row {}: a time of {} s; allowed: +-{:.0f} s", number, time_s, kLongestS));
    }
    if (loaded.rows.rows() == 0) loaded.first_s = time_s;
    const auto ns = std::llround((time_s - loaded.first_s) * 1e9);
    const auto time_ns = static_cast<std::int64_t>(
        std::llround(static_cast<long double>(ns) * loaded.stretch_thousandths / 1000));
    if (time_ns / 1000 > static_cast<std::int64_t>(kLongestS * 1e6)) {
      return fail(fmt::format("row {}: after {} s; a trajectory takes at most {:.0f} s", number,
                              time_ns / 1000000000, kLongestS));
    }
    if (loaded.rows.rows() > 0 && time_ns <= loaded.rows.time_ns(loaded.rows.rows() - 1)) {
      return fail(
          fmt::format("row {}: at {} s, and not later than the row before", number, time_s));
    }
    for (std::size_t m = 0; m < motors; ++m) {
      const auto position =
          loaded.parts[m].coordinates.parts_of_user(request.positions[row * motors + m]);
      const std::string& name = installation_[loaded.parts[m].motor].name();
      if (!position) {
        return fail(fmt::format("row {}: {}: {}", number, name, position.error().message));
      }
      positions[m] = *position;
    }
    loaded.rows.append(time_ns, positions);
  }
  if (request.part == api::Follow::Part::kLastRows) {
    if (loaded.rows.rows() < 2) return fail("a trajectory has two rows at least");
    loaded.rows.close();
  }
  return {};
}

void Trajectories::take_rows(std::int64_t now_us, const api::Asker& asker,
                             const api::Follow& request) {
  auto loaded = find(asker, request.array);
  if (loaded != trajectories_.end() && loaded->dropped) {
    trajectories_.erase(loaded);
    loaded = trajectories_.end();
  }
  const bool is_new = loaded == trajectories_.end();
  if (is_new) {
    auto begun = begin(asker, request);
    if (!begun) return asker.answer(api::Refused{begun.error().text()});
    loaded = *begun;
  }
  loaded->after_stops = std::min(loaded->after_stops, asker.after_stops);
  if (const auto by = overtaken(*loaded)) {
    loaded->dropped = request.part == api::Follow::Part::kLastRows;
    return open_.not_begun(asker, *by);
  }
  if (const auto reply = stopped(asker, *loaded)) {
    loaded->spoilt = true;
    return asker.answer(*reply);
  }
  auto taken = may_go_on(*loaded, request);
  if (taken) taken = has_time(now_us, *loaded);
  if (taken) {
    taken = take(*loaded, request);
    // A part of its rows is there, and another one is not.
    loaded->spoilt = !taken;
  }
  if (!taken) {
    if ((is_new || loaded->spoilt) && !loaded->followed) trajectories_.erase(loaded);
    return asker.answer(api::Refused{taken.error().text()});
  }
  asker.answer(api::Accepted{});
  if (!loaded->check && loaded->rows.rows() > 0) {
    loaded->check =
        std::make_unique<TrajectoryCheck>(loaded->rows, bounds_of(*loaded), tick_ns_of(*loaded));
  }
  loaded->waits = true;
  jobs_.push_back({.asker = asker, .trajectory = loaded, .longer = {}, .check_of_longer = {}});
}

std::vector<TrajectoryCheck::Motor> Trajectories::bounds_of(const Loaded& loaded) const {
  std::vector<TrajectoryCheck::Motor> bounds;
  for (const Part& part : loaded.parts) bounds.push_back(part.bounds);
  return bounds;
}

std::uint32_t Trajectories::tick_ns_of(const Loaded& loaded) const {
  const Mcu& mcu = installation_.mcu_of(loaded.parts.front().motor);
  return installation_.bus_of(mcu).config.tick_ns();
}

void Trajectories::work() {
  if (jobs_.empty()) return;
  ++units_;
  Job& job = jobs_.front();
  TrajectoryCheck* check =
      job.check_of_longer ? job.check_of_longer.get() : job.trajectory->check.get();
  const auto motors = static_cast<unsigned>(job.trajectory->parts.size());
  if (check != nullptr && check->work(std::max(kTicksPerSlice / motors, 1u))) return;
  if (check != nullptr && check->first() && try_longer(job)) return;
  end_job(now_us_);
}

// Whether there is still something to be found out of how much longer its times must be.
bool Trajectories::try_longer(Job& job) const {
  const Loaded& loaded = *job.trajectory;
  const TrajectoryCheck& last = job.check_of_longer ? *job.check_of_longer : *loaded.check;
  const std::int64_t factor = last.stretch_thousandths();
  if (!loaded.rows.closed() || loaded.followed || factor == 0 || ++job.tries > kMostTries) {
    job.thousandths = 0;
    return false;
  }
  job.thousandths = (job.thousandths * factor + 999) / 1000;
  job.check_of_longer.reset();
  job.longer = std::make_unique<Trajectory>(loaded.rows.stretched(job.thousandths));
  if (job.longer->time_ns(job.longer->rows() - 1) / 1000 >
      static_cast<std::int64_t>(kLongestS * 1e6)) {
    job.thousandths = 0;
    return false;
  }
  job.check_of_longer =
      std::make_unique<TrajectoryCheck>(*job.longer, bounds_of(loaded), tick_ns_of(loaded));
  return true;
}

void Trajectories::end_job(std::int64_t now_us) {
  Job job = std::move(jobs_.front());
  jobs_.pop_front();
  Loaded& loaded = *job.trajectory;
  loaded.waits = false;
  if (loaded.check && loaded.check->first()) {
    job.asker.answer(
        api::Completed{.outcome = api::Outcome::kFault, .reason = text_of(job), .detail = {}});
    loaded.spoilt = true;
    if (!loaded.followed) trajectories_.erase(job.trajectory);
    return;
  }
  if (loaded.followed) {
    if (const auto time = has_time(now_us, loaded); !time) {
      loaded.spoilt = true;
      const auto reply = stopped(job.asker, loaded);
      return job.asker.answer(reply.value_or(api::Completed{
          .outcome = api::Outcome::kFault, .reason = time.error().text(), .detail = {}}));
    }
    accept_rows(loaded);
  }
  const std::string rows = fmt::format("{} rows", loaded.rows.rows());
  if (!loaded.rows.closed()) return job.asker.answer(api::done(rows + " can be followed so far"));
  job.asker.answer(api::Completed{.outcome = api::Outcome::kDone,
                                  .reason = rows + " can be followed",
                                  .detail = plan_of(loaded)});
}

// They have been checked: motors that follow the trajectory may go on with them.
void Trajectories::accept_rows(Loaded& loaded) {
  Trajectory& followed = *loaded.followed;
  std::vector<Trajectory::Position> positions(loaded.parts.size());
  for (std::size_t row = followed.rows(); row < loaded.rows.rows(); ++row) {
    for (std::size_t m = 0; m < positions.size(); ++m) positions[m] = loaded.rows.position(row, m);
    followed.append(loaded.rows.time_ns(row), positions);
  }
  if (loaded.rows.closed()) followed.close();
  journal_.trajectory_rows(loaded.logged, followed, loaded.motors());
  for (const MotorId id : loaded.motors()) installation_[id].axis().trajectory_grew();
  installation_.changed = true;
}

std::string Trajectories::text_of(const Job& job) const {
  const Loaded& loaded = *job.trajectory;
  const TrajectoryCheck::Finding& finding = *loaded.check->first();
  const Part& part = loaded.parts[finding.motor];
  const std::string& name = installation_[part.motor].name();
  const double time_s = static_cast<double>(loaded.rows.time_ns(finding.row)) * 1e-9;
  const std::string where = fmt::format("row {} ({:.6g} s): {}", finding.row + 1, time_s, name);
  if (finding.fault == TrajectoryCheck::Fault::kPosition) {
    const bool falls = part.coordinates.scale().negative;
    return fmt::format("{} would go to {}; allowed: {} to {}", where,
                       part.coordinates.text(finding.steps),
                       part.coordinates.text(falls ? part.bounds.highest : part.bounds.lowest),
                       part.coordinates.text(falls ? part.bounds.lowest : part.bounds.highest));
  }
  const double unit = std::abs(part.coordinates.user_of(1) - part.coordinates.user_of(0));
  const char* what = finding.fault == TrajectoryCheck::Fault::kSpeed     ? "is to move"
                     : finding.fault == TrajectoryCheck::Fault::kCorner  ? "is to change at once"
                     : finding.fault == TrajectoryCheck::Fault::kSpeedUp ? "is to speed up"
                                                                         : "is to slow down from";
  std::string text = fmt::format("{} {} {} {:.6g} {}/s; allowed: {:.6g} {}/s", where, what,
                                 finding.fault == TrajectoryCheck::Fault::kSlowDown ? "a speed of"
                                 : finding.fault == TrajectoryCheck::Fault::kSpeed  ? "at"
                                                                                    : "to",
                                 finding.asked_steps_per_s * unit, part.coordinates.unit(),
                                 finding.allowed_steps_per_s * unit, part.coordinates.unit());
  if (!loaded.rows.closed() || loaded.followed) return text;
  if (job.thousandths == 0) return text;
  return text +
         fmt::format("; with times stretched by {:.3f} all motors can follow it",
                     static_cast<double>(loaded.stretch_thousandths * job.thousandths) * 1e-6);
}

api::MovePlan Trajectories::plan_of(const Loaded& loaded) const {
  const Trajectory& rows = loaded.rows;
  const std::size_t last = rows.rows() - 1;
  api::MovePlan plan;
  plan.duration_us = rows.time_ns(last) / 1000;
  plan.ticks = rows.time_ns(last) / tick_ns_of(loaded);
  for (std::size_t m = 0; m < loaded.parts.size(); ++m) {
    plan.motors.push_back({.motor = installation_[loaded.parts[m].motor].name(),
                           .steps = motion::nearest_step(rows.position(last, m)) -
                                    motion::nearest_step(rows.position(0, m)),
                           .duration_us = plan.duration_us,
                           .peak_steps_per_s = loaded.check->peak_steps_per_s(m)});
  }
  return plan;
}

}  // namespace bushd::daemon
