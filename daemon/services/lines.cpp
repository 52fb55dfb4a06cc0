#include "daemon/services/lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "base/output_bits.h"
#include "base/overloaded.h"
#include "daemon/services/line_motors.h"
#include "words/remedy.h"

namespace bushd::daemon {

void Lines::lend(const api::Asker& asker, tables::TablePtr table) {
  std::erase_if(lent_, [&](const Lent& lent) { return lent.asker.is_same_client(asker); });
  lent_.push_back({.asker = asker, .table = std::move(table)});
}

tables::TablePtr Lines::take_lent(const api::Asker& asker) {
  const auto lent = std::ranges::find_if(lent_, [&](const Lent& one) {
    return one.asker.number == asker.number && one.asker.is_same_client(asker);
  });
  if (lent == lent_.end()) return {};
  tables::TablePtr table = std::move(lent->table);
  lent_.erase(lent);
  return table;
}

void Lines::request(std::int64_t now_us, const api::Asker& asker, const api::MoveLine& request) {
  const tables::TablePtr by = take_lent(asker);
  const auto motors = installation_.find(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  const bool moves = std::ranges::any_of(
      *motors, [this](MotorId motor) { return installation_[motor].has_plan(); });
  for (const MotorId motor : *motors) {
    if (!installation_[motor].is<motion::Armed>()) continue;
    return asker.answer(api::Refused{motion::busy_text(installation_[motor]) + "; run " +
                                     words::remedy("disarm", installation_[motor].name()) +
                                     " first, or wait for it"});
  }
  if (moves) return redirect(now_us, asker, *motors, request);
  auto line = line_of(request, by);
  if (!line) return asker.answer(api::Refused{line.error().text()});
  if (request.dry_run) return plan_only(now_us, asker, *line, *line->straight());
  start(now_us, asker, std::move(*line));
}

bool Lines::would_take(const api::MoveLine& request) const {
  const auto motors = installation_.find(request.motors);
  if (!motors) return false;
  if (std::ranges::any_of(*motors, [this](MotorId id) { return installation_[id].has_plan(); })) {
    return true;
  }
  return may_be_one_line(installation_, *motors) && points_of(*motors, request);
}

const std::string& Lines::limiting(const Line& line, const motion::Way& way) const {
  return installation_[line.motors[way.limiting()]].name();
}

void Lines::plan_only(std::int64_t now_us, const api::Asker& asker, const Line& line,
                      const Straight& straight) {
  std::vector<DryRun::Part> parts;
  std::vector<motion::Way> ways{straight.way};
  for (std::size_t p = 1; p < straight.points.size(); ++p) {
    ways.push_back(lay(line.motors, straight, straight.points[p - 1].steps, straight.points[p]));
  }
  const bool by_mcus =
      straight.way.longest() != 0 && (in_mcus(0, line) || table_to_upload(line, false));
  // The ways of one motor stand together.
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    for (const motion::Way& one : ways) {
      const std::int64_t from = one.motors()[i].from;
      DryRun::Part part{line.motors[i], one.motors()[i].to - from, one.shortest_delay(), from};
      if (one.longest() != 0) part.line = one.share(i, 0, one.longest());
      if (part.line) part.line->in_mcus = by_mcus;
      parts.push_back(std::move(part));
    }
  }
  dry_runs_.request(now_us, asker, parts,
                    straight.way.longest() != 0 ? limiting(line, straight.way) : "");
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
  const auto path_laid = [&](AlongPath& along) {
    along.path->set_number(journal_.path_laid(line.motors, *along.path));
  };
  const auto way_laid = [&](Straight& straight) {
    motion::Way& way = straight.way;
    std::vector<Journal::OnWay> motors;
    for (std::size_t i = 0; i < line.motors.size(); ++i) {
      motors.push_back({.motor = line.motors[i],
                        .increment = way.increment(i),
                        .shortest_delay = way.motors()[i].shortest_delay,
                        .table = table_of(line.motors[i], straight.by)});
    }
    way.set_number(journal_.line_laid(way, motors));
  };
  std::visit(Overloaded{path_laid, way_laid}, line.course);
}

void Lines::open(const api::Asker& asker, std::uint64_t number, const Line& line) {
  // By a table of its own a motor makes what is a move for everybody.
  const tables::TablePtr by = line.straight() != nullptr ? line.straight()->by : nullptr;
  const auto purpose = by ? OpenMoves::Purpose::kMove : OpenMoves::Purpose::kLine;
  open_.open(asker, line.motors, purpose, by);
  ask_for_end(line);
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    open_.planned(line.motors[i], static_cast<int>(line.legs()), line.most_steps_per_s(i));
  }
  if (line.longest() == 0 || by) return;
  open_.conclude(line.motors.front(), [this, number] { return conclusion(number); });
}

// A path leads through many points, which are rounded each.
void Lines::ask_for_end(const Line& line) {
  const Straight* straight = line.straight();
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    installation_[line.motors[i]].ask_for(
        straight == nullptr ? std::nullopt : std::optional(straight->points.back().asked_for[i]));
  }
}

// The MCUs make the run themselves if all of them can: it is slow enough, they have its table, and
// no other line.
bool Lines::in_mcus(std::uint64_t number, const Line& line) const {
  const Straight* straight = line.straight();
  if (straight == nullptr) return false;
  const motion::Way& way = straight->way;
  const bushd_table& table = way.table()->view();
  return std::ranges::all_of(installation_.mcus_of(line.motors), [&](McuId id) {
    const Mcu& mcu = installation_[id];
    return mcu.can_run_line(table, way.shortest_delay(), has_all_of(line, mcu)) &&
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
  Straight* straight = line.straight();
  std::shared_ptr<link::LinePace> pace;  // paths are not of ports
  if (straight != nullptr && installation_.mcu_of(motors.front()).offers.paced_lines != nullptr) {
    const std::int64_t ahead_ns = straight->pace ? straight->pace->most_ahead_ns() : 0;
    pace = std::make_shared<link::LinePace>(static_cast<unsigned>(motors.size()), ahead_ns);
    straight->pace = pace;
  }
  const bool anew = begins_anew(number, line);
  const bool by_mcus =
      pace || (in_mcus(number, line) && may_be_in_mcus(number, line, indices, anew));
  const std::map<BusId, motion::Tick> start = starts_of(now_us, line, motors, by_mcus);
  for (const std::size_t i : indices) {
    motion::Motor& motor = installation_[line.motors[i]];
    motion::OnLine on_line;
    on_line.line = number;
    on_line.target_steps = line.end_of(i);
    on_line.to_point = to == line.target;
    on_line.last_run = line.legs() == 1 && to == line.target;
    const std::uint32_t from = from_of(number, line, i, anew);
    motion::LineShare share = line.share(i, from, to);
    share.line = number;
    share.in_mcus = by_mcus;
    const BusId bus = installation_.mcu_of(line.motors[i]).config.bus;
    motor.line().start(on_line, std::move(share), start.at(bus),
                       straight == nullptr ? 0 : straight->way.shortest_delay());
  }
  moves_.begin_on_line(motors, pace);
}

// Where the run of one of its motors begins, in steps of the line.
std::uint32_t Lines::from_of(std::uint64_t number, const Line& line, std::size_t i,
                             bool anew) const {
  const motion::Motor& motor = installation_[line.motors[i]];
  const auto* before = motor.as<motion::OnLine>();
  const bool same_way =
      before != nullptr && before->line == number && line.is_of(*motor.axis().line());
  return same_way ? place_of(line.motors[i], anew) : 0;
}

// An MCU makes lines by the elementary law from their beginning, of all motors: the rest of one
// that was paused is streamed.
bool Lines::may_be_in_mcus(std::uint64_t number, const Line& line,
                           const std::vector<std::size_t>& indices, bool anew) const {
  const Straight* straight = line.straight();
  if (straight == nullptr || !straight->way.is_elementary()) return true;
  return indices.size() == line.motors.size() && std::ranges::all_of(indices, [&](std::size_t i) {
           return from_of(number, line, i, anew) == 0;
         });
}

std::map<BusId, motion::Tick> Lines::starts_of(std::int64_t now_us, const Line& line,
                                               const std::vector<MotorId>& motors, bool by_mcus) {
  std::map<BusId, std::map<McuId, std::uint16_t>> masks;
  std::map<BusId, motion::Tick> starts;
  for (const MotorId id : motors) {
    const Mcu& mcu = installation_.mcu_of(id);
    const Output output = installation_[id].output();
    masks[mcu.config.bus][mcu.id] |= bit_of(output);
    motion::Tick& start = starts.try_emplace(mcu.config.bus, INT64_MIN).first->second;
    start = std::max(start, mcu.earliest_start(now_us, output));
  }
  if (!by_mcus || line.path() != nullptr) return starts;
  for (const auto& [bus, of_bus] : masks) {
    std::vector<link::ToBegin> together;
    for (const auto& [mcu, outputs] : of_bus) {
      together.push_back({installation_[mcu].on_bus(), outputs, link::StartMessages::kLineRun});
    }
    link::BusMaster& master = installation_[bus].master;
    const link::CommonStart start = master.earliest_common_start(now_us, together);
    if (start.to_confirm) master.confirm_start(start.at);
    starts[bus] = start.at;
  }
  return starts;
}

std::uint32_t Lines::place_of(MotorId motor, bool anew) const {
  const motion::Axis& axis = installation_[motor].axis();
  const bool not_begun = anew && (motion::is_late(installation_[motor]) || only_waits(motor));
  return not_begun ? axis.line()->from : axis.line_planned_end();
}

const motion::OnLine* Lines::on_line(MotorId motor, std::uint64_t number) const {
  const auto* on_line = installation_[motor].as<motion::OnLine>();
  return on_line != nullptr && on_line->line == number ? on_line : nullptr;
}

void Lines::step(std::int64_t now_us) {
  if (auto planned = paths_.take_planned()) {
    Line& line = planned->line;
    if (planned->dry_run) {
      plan_only(now_us, planned->asker, line, *line.path());
    } else {
      start(now_us, planned->asker, std::move(line));
    }
  }
  for (auto it = lines_.begin(); it != lines_.end();) {
    it = follow(now_us, it->first, it->second) ? std::next(it) : lines_.erase(it);
  }
}

bool Lines::follow(std::int64_t now_us, std::uint64_t number, Line& line) {
  if (line.waits() && !follow_trigger(now_us, number, line, *line.straight()->trigger)) {
    return true;
  }
  end_split_start(number, line);
  const auto cause = cause_to_end(now_us, number, line);
  if (cause) end(now_us, number, line, *cause);
  bool any = false;
  bool all_stand = !cause;
  const bool late = begins_anew(number, line);
  for (const MotorId id : line.motors) {
    const motion::OnLine* motor = on_line(id, number);
    if (motor == nullptr) continue;
    any = true;
    const bool paused = installation_[id].is_paused();
    const bool stops = installation_[id].stops() && !paused;
    const bool stands = motor->stands || (late && only_waits(id));
    all_stand = all_stand && stands && !stops && (!paused || motor->resumes);
  }
  if (any && all_stand) go_on(now_us, number, line);
  return any;
}

// It makes no step of the run, and is not told of it.
bool Lines::only_waits(MotorId motor) const {
  const motion::Axis& axis = installation_[motor].axis();
  const bool would_begin =
      motion::is_late(installation_[motor]) || motion::is_withdrawn(installation_[motor]);
  return !would_begin && axis.end_tick() <= axis.start_tick();
}

bool Lines::begins_anew(std::uint64_t number, const Line& line) const {
  return std::ranges::any_of(line.motors, [&](MotorId id) {
    return on_line(id, number) != nullptr && motion::is_late(installation_[id]);
  });
}

void Lines::end_split_start(std::uint64_t number, const Line& line) {
  std::vector<MotorId> late;
  bool begun = false;
  for (const MotorId id : line.motors) {
    const motion::Motor& motor = installation_[id];
    if (on_line(id, number) == nullptr) continue;
    if (motion::is_late(motor)) {
      late.push_back(id);
    } else {
      begun = begun || moves_.has_begun(id);
    }
  }
  if (!begun && line.tries < CommonStarts::kMostTries) return;
  for (const MotorId id : late) {
    motion::Motor& motor = installation_[id];
    moves_.end(id, *motor.end(api::Outcome::kLink, motor.start_of_run().missed_text()));
  }
}

// Why the line ends, if one motor does not go on along it as the others do. At the end of a run
// their reports come one after the other.
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
    const bool stops = motor.stops() && !motor.is_paused();
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
  const bool late = begins_anew(number, line);
  line.tries = late ? line.tries + 1 : 1;
  for (const MotorId id : line.motors) {
    if (late && only_waits(id)) journal_.ended(id, "late");
  }
  std::uint32_t farthest = 0;
  for (const MotorId id : line.motors) {
    farthest = std::max(farthest, place_of(id, late));
  }
  std::vector<std::size_t> behind;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    all.push_back(i);
    if (place_of(line.motors[i], late) < farthest) behind.push_back(i);
  }
  if (!behind.empty()) return begin_run(now_us, number, line, behind, farthest);
  if (AlongPath* along = line.path()) {
    if (farthest < line.target && along->rest->first_step() != farthest) {
      along->rest = along->path->rest(farthest);
      along->track.reset();
    }
    if (!along->rest->is_planned()) return;  // as soon as it is
  }
  if (farthest < line.target) return begin_run(now_us, number, line, all, line.target);
  Straight* straight = line.straight();
  if (straight == nullptr) return;  // the last run of a path leads to its end
  // At a point that is not the last, or beyond one that came too late.
  std::vector<Straight::Point>& points = straight->points;
  if (farthest == line.target) points.erase(points.begin());
  std::vector<std::int64_t> from;
  for (const MotorId id : line.motors) from.push_back(installation_[id].position_steps());
  straight->way = lay(line.motors, *straight, from, points.front());
  line.target = line.longest();
  log(line);
  begin_run(now_us, number, line, all, line.target);
}

std::string Lines::conclusion(std::uint64_t number) const {
  const auto found = lines_.find(number);
  if (found == lines_.end()) return {};
  const Line& line = found->second;
  if (!line.has_begun()) return {};
  const bool moves_on = std::ranges::any_of(
      line.motors, [&](MotorId motor) { return on_line(motor, number) != nullptr; });
  if (moves_on) return {};
  const Straight* straight = line.straight();
  if (straight == nullptr) return deviation(line).insert(0, "; the path has ended");
  return fmt::format("; the line was limited by {}{}{}", limiting(line, straight->way),
                     deviation(line), apart(*straight));
}

std::string Lines::apart(const Straight& line) {
  if (!line.pace) return {};
  return fmt::format("; the ports were at most {:.1f} ms apart",
                     1e-6 * static_cast<double>(line.pace->most_ahead_ns()));
}

// At the point of the line that is nearest to where the motors stand.
std::string Lines::deviation(const Line& line) const {
  const Straight* straight = line.straight();
  std::uint32_t at = 0;
  std::size_t farthest_off = 0;
  std::int64_t least = INT64_MAX;
  // One that has ended earlier may have begun to move again.
  const auto followed = [&](std::size_t i) {
    const auto& share = installation_[line.motors[i]].axis().line();
    return share && line.is_of(*share);
  };
  std::vector<std::uint32_t> candidates;
  std::int64_t elementary = 0;  // steps of all
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    if (!followed(i)) continue;
    candidates.push_back(installation_[line.motors[i]].axis().line_planned_end());
    // Where MCUs have ramped the run down by themselves nobody has planned it.
    if (straight == nullptr) continue;
    const std::int64_t made =
        std::abs(installation_[line.motors[i]].position_steps() - line.position_at(i, 0));
    elementary += made;
    if (straight->way.increment(i) != line.longest()) continue;
    candidates.push_back(static_cast<std::uint32_t>(std::min<std::int64_t>(made, line.longest())));
  }
  if (straight != nullptr && straight->way.is_elementary()) {
    candidates.push_back(
        static_cast<std::uint32_t>(std::min<std::int64_t>(elementary, line.longest())));
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
