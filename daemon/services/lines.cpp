#include "daemon/services/lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "words/remedy.h"

namespace bushd::daemon {

void Lines::request(std::int64_t now_us, const api::Asker& asker, const api::MoveLine& request) {
  const auto motors = installation_.find(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  const bool moves = std::ranges::any_of(
      *motors, [this](MotorId motor) { return installation_[motor].has_plan(); });
  for (const MotorId motor : *motors) {
    if (!installation_[motor].is<motion::Armed>()) continue;
    return asker.answer(api::Refused{installation_[motor].busy_text() + "; run " +
                                     words::remedy("disarm", installation_[motor].name()) +
                                     " first, or wait for it"});
  }
  if (moves) return redirect(now_us, asker, *motors, request);
  auto line = line_of(request);
  if (!line) return asker.answer(api::Refused{line.error().text()});
  if (request.dry_run) return plan_only(now_us, asker, *line);
  start(now_us, asker, std::move(*line));
}

bool Lines::would_take(const api::MoveLine& request) const {
  const auto motors = installation_.find(request.motors);
  if (!motors) return false;
  if (std::ranges::any_of(*motors, [this](MotorId id) { return installation_[id].has_plan(); })) {
    return true;
  }
  const Line line{.motors = *motors, .points = {}, .way = {}, .by = request.by};
  return may_be_one_line(*motors) && points_of(line, request);
}

const std::string& Lines::limiting(const Line& line) const {
  return installation_[line.motors[line.way.limiting()]].name();
}

void Lines::plan_only(std::int64_t now_us, const api::Asker& asker, const Line& line) {
  std::vector<DryRun::Part> parts;
  std::vector<motion::Way> ways{line.way};
  for (std::size_t p = 1; p < line.points.size(); ++p) {
    ways.push_back(lay(line, line.points[p - 1].steps, line.points[p]));
  }
  const bool by_mcus =
      line.way.longest() != 0 && (in_mcus(0, line) || table_to_upload(line, false));
  // The ways of one motor stand together.
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    for (const motion::Way& way : ways) {
      const auto& [table, from, to, shortest_delay] = way.motors()[i];
      DryRun::Part part{line.motors[i], to - from, way.shortest_delay(), from};
      if (way.longest() != 0) part.line = way.share(i, 0, way.longest());
      if (part.line) part.line->in_mcus = by_mcus;
      parts.push_back(std::move(part));
    }
  }
  dry_runs_.request(now_us, asker, parts, line.way.longest() != 0 ? limiting(line) : "");
}

void Lines::start(std::int64_t now_us, const api::Asker& asker, Line line) {
  asker.answer(api::Accepted{});
  const std::uint64_t number = ++last_number_;
  open(asker, number, line);
  if (line.longest() == 0) {
    // Each by a run of no steps, as it would alone.
    for (const MotorId motor : line.motors) {
      const auto stands = moves_.go_on(now_us, motor, installation_[motor].position_steps());
      if (!stands) open_.end(motor, api::Outcome::kStopped, stands.error().text());
    }
    return ask_for_end(line);
  }
  Line& kept = lines_.emplace(number, std::move(line)).first->second;
  log(kept);
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < kept.motors.size(); ++i) all.push_back(i);
  begin_run(now_us, number, kept, all, kept.target);
}

void Lines::log(Line& line) {
  if (line.path) {
    line.path->set_number(journal_.path_laid(line.motors, *line.path));
    return;
  }
  std::vector<Journal::OnWay> motors;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    motors.push_back({.motor = line.motors[i],
                      .increment = line.way.increment(i),
                      .shortest_delay = line.way.motors()[i].shortest_delay,
                      .table = table_of(line, i)});
  }
  line.way.set_number(journal_.line_laid(line.way.longest(), motors));
}

void Lines::open(const api::Asker& asker, std::uint64_t number, const Line& line) {
  // By a table of its own a motor makes what is a move for everybody.
  const auto purpose = line.by ? OpenMoves::Purpose::kMove : OpenMoves::Purpose::kLine;
  open_.open(asker, line.motors, purpose, line.by);
  ask_for_end(line);
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    open_.planned(line.motors[i], static_cast<int>(line.points.size()), line.most_steps_per_s(i));
  }
  if (line.longest() == 0 || line.by) return;
  open_.conclude(line.motors.front(), [this, number] { return conclusion(number); });
}

// A path leads through many points, which are rounded each.
void Lines::ask_for_end(const Line& line) {
  const std::vector<units::Steps>& ends = line.points.back().asked_for;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    installation_[line.motors[i]].ask_for(ends.empty() ? std::nullopt : std::optional(ends[i]));
  }
}

// The MCUs make the run themselves if all of them can: it is slow enough, they have its table, and
// no other line.
bool Lines::in_mcus(std::uint64_t number, const Line& line) const {
  if (line.path) return false;
  const bushd_table& table = line.way.table()->view();
  return std::ranges::all_of(installation_.mcus_of(line.motors), [&](McuId id) {
    const Mcu& mcu = installation_[id];
    return mcu.can_run_line(table, line.way.shortest_delay(), has_all_of(line, mcu)) &&
           !makes_another(mcu, number);
  });
}

bool Lines::makes_another(const Mcu& mcu, std::uint64_t number) const {
  return std::ranges::any_of(mcu.motors(), [&](MotorId motor) {
    const auto* other = installation_[motor].as<motion::OnLine>();
    return other != nullptr && other->line != number && installation_[motor].axis().line() &&
           installation_[motor].axis().line()->in_mcus;
  });
}

bool Lines::has_all_of(const Line& line, const Mcu& mcu) {
  return std::ranges::all_of(mcu.motors(), [&](MotorId motor) {
    return std::ranges::find(line.motors, motor) != line.motors.end();
  });
}

void Lines::begin_run(std::int64_t now_us, std::uint64_t number, Line& line,
                      const std::vector<std::size_t>& indices, std::uint32_t to) {
  std::vector<MotorId> motors;
  for (const std::size_t i : indices) motors.push_back(line.motors[i]);
  const std::map<BusId, motion::Tick> start = starts_of(now_us, motors);
  const bool by_ports = installation_.mcu_of(motors.front()).keeps_pace();
  const auto ports = static_cast<unsigned>(motors.size());
  const std::int64_t ahead_ns = line.pace ? line.pace->most_ahead_ns() : 0;
  line.pace = by_ports ? std::make_shared<link::LinePace>(ports, ahead_ns) : nullptr;
  const bool by_mcus = by_ports || in_mcus(number, line);
  for (const std::size_t i : indices) {
    motion::Motor& motor = installation_[line.motors[i]];
    const auto* before = motor.as<motion::OnLine>();
    const bool same_way = before != nullptr && before->line == number &&
                          (line.path || motor.axis().line()->table == line.way.table());
    motion::OnLine on_line;
    on_line.line = number;
    on_line.target_steps = line.points.back().steps[i];
    on_line.to_point = to == line.target;
    on_line.last_run = line.points.size() == 1 && to == line.target;
    const std::uint32_t from = same_way ? motor.axis().line_planned_end() : 0;
    motion::LineShare share = line.share(i, from, to);
    share.line = number;
    share.in_mcus = by_mcus;
    const BusId bus = installation_.mcu_of(line.motors[i]).config.bus;
    motor.start_line(on_line, std::move(share), start.at(bus),
                     line.path ? 0 : line.way.shortest_delay());
  }
  moves_.begin_on_line(motors, line.pace);
}

// One tick of each bus: there is one, or one a motor.
std::map<BusId, motion::Tick> Lines::starts_of(std::int64_t now_us,
                                               const std::vector<MotorId>& motors) const {
  std::map<BusId, motion::Tick> start;
  for (const MotorId id : motors) {
    const Mcu& mcu = installation_.mcu_of(id);
    motion::Tick& of_bus = start.try_emplace(mcu.config.bus, INT64_MIN).first->second;
    of_bus = std::max(of_bus, mcu.earliest_start(now_us, installation_[id].output()));
  }
  return start;
}

const motion::OnLine* Lines::on_line(MotorId motor, std::uint64_t number) const {
  const auto* on_line = installation_[motor].as<motion::OnLine>();
  return on_line != nullptr && on_line->line == number ? on_line : nullptr;
}

Result<std::uint64_t> Lines::number_of(const std::vector<MotorId>& motors) const {
  const motion::OnLine* first = installation_[motors.front()].as<motion::OnLine>();
  const auto whole = first == nullptr ? lines_.end() : lines_.find(first->line);
  for (const MotorId motor : motors) {
    if (whole != lines_.end() && on_line(motor, whole->first) != nullptr) continue;
    return fail(fmt::format(
        "{} is not on one line with the others: motors of a line begin it at rest; stop "
        "those that move first",
        installation_[motor].name()));
  }
  if (motors.size() != whole->second.motors.size()) {
    return fail(
        fmt::format("{} motors move on this line and {} are named; name all of them, or "
                    "run {} first",
                    whole->second.motors.size(), motors.size(),
                    words::remedy("stop", installation_[motors.front()].name())));
  }
  return whole->first;
}

// The step of the line at which all motors are where they are asked to be.
Result<std::uint32_t> Lines::step_of(const Line& line, const std::vector<MotorId>& motors,
                                     const api::MoveLine& request,
                                     std::vector<units::Steps>& targets) const {
  const std::vector<motion::Way::Motor>& ways = line.way.motors();
  targets.resize(motors.size());
  std::optional<std::int64_t> step;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const motion::Motor& motor = installation_[motors[i]];
    const bool absolute = request.kind == api::Move::Kind::kAbsolute;
    const api::Amount& amount = request.motors[i].amount;
    const auto steps = absolute ? motor.position_of(amount) : motor.distance_of(amount);
    if (!steps) return fail(motor.name() + ": " + steps.error().message);
    const auto at =
        static_cast<std::size_t>(std::ranges::find(line.motors, motors[i]) - line.motors.begin());
    // Compared before any arithmetic: the sum of two values from outside could overflow.
    if (std::abs(steps->whole / 2) > motion::Motor::kMaxPosition) {
      return fail(fmt::format("{}: {} steps is out of range; allowed: +-{}", motor.name(),
                              steps->whole, motion::Motor::kMaxPosition));
    }
    const auto from = absolute ? Result<units::Steps>() : motor.distance_from();
    if (!from) return fail(motor.name() + ": " + from.error().message);
    targets[at] = *steps + *from;
    if (line.way.increment(at) != line.way.longest()) continue;
    step = (targets[at].whole - ways[at].from) * (ways[at].to < ways[at].from ? -1 : 1);
  }
  const std::uint32_t end = line.target;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const motion::Motor& motor = installation_[line.motors[i]];
    if (*step < 0 || *step > end) {
      return fail(
          fmt::format("{}: {} is beyond the ends of the line that is under way; run {} first, "
                      "or wait for its result",
                      motor.name(), motor.coordinates().text(targets[i].whole),
                      words::remedy("stop", motor.name())));
    }
    const auto s = static_cast<std::uint32_t>(*step);
    const std::int64_t on_way = line.way.position_at(i, s);
    if (targets[i].whole == on_way) continue;
    return fail(
        fmt::format("{}: {} is not on the line that is under way, which leads through {} "
                    "there; run {} first, or wait for its result",
                    motor.name(), motor.coordinates().text(targets[i].whole),
                    motor.coordinates().text(on_way), words::remedy("stop", motor.name())));
  }
  return static_cast<std::uint32_t>(*step);
}

void Lines::redirect(std::int64_t now_us, const api::Asker& asker,
                     const std::vector<MotorId>& motors, const api::MoveLine& request) {
  const auto refuse = [&asker](const std::string& why) { asker.answer(api::Refused{why}); };
  const std::string& name = installation_[motors.front()].name();
  if (request.dry_run) return refuse(name + " moves; a dry run is of lines from rest");
  if (request.duration_s) {
    return refuse("the line is under way: a duration is of a line from rest; give a speed");
  }
  const auto number = number_of(motors);
  if (!number) return refuse(number.error().text());
  Line& line = lines_.at(*number);
  const std::string stop = "run " + words::remedy("stop", name) + " first";
  if (line.path) return refuse(name + " moves on a path; " + stop + ", or wait for its result");
  if (line.points.size() > 1) {
    return refuse("the line ends in a last approach for backlash; " + stop);
  }
  std::vector<bushd_delay> shortest_delays;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const motion::Motor& motor = installation_[line.motors[i]];
    if (motor.axis().stopping() || motor.is_paused() || motor.as<motion::OnLine>()->stands) {
      return refuse(motor.name() + " is being stopped or paused; wait for that, or resume it");
    }
    const auto shortest_delay = moves_.shortest_delay_of(line.motors[i], request.speed);
    if (!shortest_delay) return refuse(shortest_delay.error().text());
    shortest_delays.push_back(shortest_delay_on(line, i, *shortest_delay));
  }
  std::vector<units::Steps> targets;
  const auto step = step_of(line, motors, request, targets);
  if (!step) return refuse(step.error().text());
  line.way.set_shortest_delays(shortest_delays);
  asker.answer(api::Accepted{});
  moves_.take_over(line.motors, asker);
  line.target = *step;
  Point& to = line.points.front();
  to.shortest_delays = shortest_delays;
  to.asked_for = std::move(targets);
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    to.steps[i] = line.way.position_at(i, *step);
    motion::OnLine now = *installation_[line.motors[i]].as<motion::OnLine>();
    now.target_steps = to.steps[i];
    now.last_run = true;
    installation_[line.motors[i]].aim_on_line(now, *step, line.way.shortest_delay());
  }
  open(asker, *number, line);
  moves_.redirect_on_line(now_us, line.motors);
}

void Lines::step(std::int64_t now_us) {
  if (!coming_.empty() && coming_.front().path.line.path->is_planned()) {
    Coming planned = std::move(coming_.front());
    coming_.pop_front();
    begin_path(now_us, std::move(planned));
  }
  for (auto it = lines_.begin(); it != lines_.end();) {
    it = follow(now_us, it->first, it->second) ? std::next(it) : lines_.erase(it);
  }
}

bool Lines::follow(std::int64_t now_us, std::uint64_t number, Line& line) {
  if (line.waits && !follow_trigger(now_us, number, line)) return true;
  const auto cause = cause_to_end(now_us, number, line);
  if (cause) end(now_us, number, line, *cause);
  bool any = false;
  bool all_stand = !cause;
  for (const MotorId id : line.motors) {
    const motion::OnLine* motor = on_line(id, number);
    if (motor == nullptr) continue;
    any = true;
    const bool paused = installation_[id].is_paused();
    const bool stops = installation_[id].axis().stopping() && !paused;
    all_stand = all_stand && motor->stands && !stops && (!paused || motor->resumes);
  }
  if (any && all_stand) go_on(now_us, number, line);
  return any;
}

// Of a motor that does not go on along the line as the others do. At the end of a run their reports
// come one after the other.
std::optional<std::string> Lines::cause_to_end(std::int64_t now_us, std::uint64_t number,
                                               const Line& line) const {
  std::optional<std::string> cause;
  bool any_goes_on = false;
  for (const MotorId id : line.motors) {
    const motion::Motor& motor = installation_[id];
    const motion::OnLine* now = on_line(id, number);
    if (now == nullptr) {
      if (!cause) cause = motor.name() + " does not move on";
      continue;
    }
    const bool emergency = (now->faults & BUSHD_FAULT_EMERGENCY) != 0;  // that of all
    if (now->limit != 0) cause = motor.name() + " has come to its limit switch";
    if (now->position_mismatch) cause = motor.name() + " is not where it should be";
    if (now->faults != 0 && !emergency) {
      cause = "MCU " + installation_.mcu_of(id).name() + " has a fault";
    }
    const link::BusMaster& master = installation_.bus_of(installation_.mcu_of(id)).master;
    const bool runs = !emergency && motor.axis().over_tick() > master.tick_at(now_us);
    const bool stops = motor.axis().stopping() && !motor.is_paused();
    const bool gone_on_without = now->limit == 0 && now->faults == 0 && !now->position_mismatch;
    any_goes_on = any_goes_on || (gone_on_without && !stops && (runs || now->stands));
  }
  if (!any_goes_on) return std::nullopt;
  return cause;
}

void Lines::end(std::int64_t now_us, std::uint64_t number, const Line& line,
                const std::string& cause) {
  std::vector<MotorId> motors;
  for (const MotorId id : line.motors) {
    if (on_line(id, number) == nullptr) continue;
    motors.push_back(id);
    open_.say(id, api::Outcome::kStopped,
              {api::Outcome::kStopped, "ramped down along the line, because " + cause});
  }
  moves_.stop(now_us, motors);
  for (const MotorId id : motors) installation_[id].is_stopped_by_others();
}

// All stand where their runs have led. Those that have been stopped earlier than others, since
// their MCU was the only one to hear of it at once, catch up first.
void Lines::go_on(std::int64_t now_us, std::uint64_t number, Line& line) {
  std::uint32_t farthest = 0;
  for (const MotorId id : line.motors) {
    farthest = std::max(farthest, installation_[id].axis().line_planned_end());
  }
  std::vector<std::size_t> behind;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    all.push_back(i);
    if (installation_[line.motors[i]].axis().line_planned_end() < farthest) behind.push_back(i);
  }
  if (!behind.empty()) return begin_run(now_us, number, line, behind, farthest);
  if (farthest < line.target && line.path && line.rest->first_step() != farthest) {
    line.rest = line.path->rest(farthest);
    line.track.reset();
  }
  if (line.path && !line.rest->is_planned()) return;  // as soon as it is
  if (farthest < line.target) return begin_run(now_us, number, line, all, line.target);
  // At a point that is not the last, or beyond one that came too late.
  if (farthest == line.target) line.points.erase(line.points.begin());
  std::vector<std::int64_t> from;
  for (const MotorId id : line.motors) from.push_back(installation_[id].position_steps());
  line.way = lay(line, from, line.points.front());
  line.target = line.way.longest();
  log(line);
  begin_run(now_us, number, line, all, line.target);
}

std::string Lines::conclusion(std::uint64_t number) const {
  const auto found = lines_.find(number);
  if (found == lines_.end()) return {};
  const Line& line = found->second;
  if (!line.begun) return {};
  const bool moves_on = std::ranges::any_of(
      line.motors, [&](MotorId motor) { return on_line(motor, number) != nullptr; });
  if (moves_on) return {};
  if (line.path) return deviation(line).insert(0, "; the path has ended");
  return fmt::format("; the line was limited by {}{}{}", limiting(line), deviation(line),
                     apart(line));
}

std::string Lines::apart(const Line& line) {
  if (!line.pace) return {};
  return fmt::format("; the ports were at most {:.1f} ms apart",
                     1e-6 * static_cast<double>(line.pace->most_ahead_ns()));
}

// At the point of the line that is nearest to where the motors stand.
std::string Lines::deviation(const Line& line) const {
  std::uint32_t at = 0;
  std::size_t farthest_off = 0;
  std::int64_t least = INT64_MAX;
  // One that has ended earlier may have begun to move again.
  const auto followed = [&](std::size_t i) {
    const auto& share = installation_[line.motors[i]].axis().line();
    return share && (line.path ? share->way == line.path->number() && share->track
                               : share->table == line.way.table());
  };
  std::vector<std::uint32_t> candidates;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    if (!followed(i)) continue;
    candidates.push_back(installation_[line.motors[i]].axis().line_planned_end());
    // Where MCUs have ramped the run down by themselves nobody has planned it.
    if (line.path || line.way.increment(i) != line.way.longest()) continue;
    const std::int64_t made =
        std::abs(installation_[line.motors[i]].position_steps() - line.way.position_at(i, 0));
    candidates.push_back(
        static_cast<std::uint32_t>(std::min<std::int64_t>(made, line.way.longest())));
  }
  for (const std::uint32_t step : candidates) {
    std::int64_t most = 0;
    std::size_t motor = 0;
    for (std::size_t i = 0; i < line.motors.size(); ++i) {
      if (!followed(i)) continue;
      const std::int64_t off =
          std::abs(installation_[line.motors[i]].position_steps() - line.position_at(i, step));
      if (off <= most) continue;
      most = off;
      motor = i;
    }
    if (most >= least) continue;
    least = most;
    at = step;
    farthest_off = motor;
  }
  if (least == INT64_MAX) return {};
  const double percent = 100.0 * at / line.longest();
  std::string text =
      at == line.longest() ? "" : fmt::format(", which was left at {:.1f} %", percent);
  if (least == 0) return text;
  return text + fmt::format("; {} stands {} steps off it",
                            installation_[line.motors[farthest_off]].name(), least);
}

}  // namespace bushd::daemon
