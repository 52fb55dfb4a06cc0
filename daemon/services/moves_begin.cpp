// How runs begin: when, whether they have, and what becomes of those that have missed their start.
#include <algorithm>
#include <map>
#include <utility>

#include "daemon/services/moves.h"

namespace bushd::daemon {
namespace {

// From one slice to the next, with what is done in between; for the common start of all motors.
constexpr std::int64_t kSliceUs = 2'000;

}  // namespace

void Moves::start(std::int64_t now_us, const api::Asker& asker, const std::vector<Part>& parts) {
  std::vector<MotorId> motors;
  std::vector<MotorId> moving;
  std::vector<FirstLeg> starting;
  std::map<BusId, std::vector<MotorId>> together;
  for (const Part& part : parts) {
    motors.push_back(part.motor);
    if (installation_[part.motor].has_plan()) moving.push_back(part.motor);
    if (!installation_[part.motor].stands()) continue;
    starting.push_back({part.motor, part.legs.front()});
    together[installation_.mcu_of(part.motor).config.bus].push_back(part.motor);
  }
  const std::map<BusId, motion::Tick> start = starts_of(now_us, starting);
  asker.answer(api::Accepted{});
  take_over(moving, asker);
  open_.open(asker, motors, OpenMoves::Purpose::kMove);
  for (const auto& [bus, of_bus] : together) starts_.begin(of_bus);
  for (const Part& part : parts) {
    motion::Motor& motor = installation_[part.motor];
    const auto& [target, shortest_delay] = part.legs.front();
    if (!motor.stands()) {
      motor.aim(target, shortest_delay);
    } else {
      motor.start(target, start.at(installation_.mcu_of(part.motor).config.bus), shortest_delay);
      unbegun_.insert(part.motor);
      to_begin_.push_back(part.motor);
    }
    motor.go_on({part.legs.begin() + 1, part.legs.end()});
    motor.ask_for(part.target);
    const auto fastest = std::ranges::min_element(part.legs, {}, &motion::Leg::shortest_delay);
    open_.planned(part.motor, static_cast<int>(part.legs.size()),
                  motor.axis().most_steps_per_s(fastest->shortest_delay));
  }
  if (unbegun_.size() <= kBeginsPerSlice) work();
  retarget(now_us, moving);
}

std::map<BusId, motion::Tick> Moves::starts_of(std::int64_t now_us,
                                               const std::vector<FirstLeg>& legs) const {
  std::map<BusId, std::vector<FirstLeg>> of_buses;
  for (const FirstLeg& leg : legs) {
    of_buses[installation_.mcu_of(leg.motor).config.bus].push_back(leg);
  }
  std::map<BusId, motion::Tick> start;
  for (const auto& [bus, of_bus] : of_buses) start[bus] = start_of(now_us, bus, of_bus);
  const std::size_t slices = legs.size() / kBeginsPerSlice;
  for (auto& [bus, tick] : start) {
    tick += static_cast<motion::Tick>(slices) * kSliceUs / installation_[bus].config.tick_us;
  }
  return start;
}

// Where there are several MCUs, some may get their first frames and others not: there is time to
// repair that.
motion::Tick Moves::start_of(std::int64_t now_us, BusId bus,
                             const std::vector<FirstLeg>& legs) const {
  const Mcu& first = installation_.mcu_of(legs.front().motor);
  std::uint16_t outputs = 0;
  bool one_mcu = true;
  bool all_by_table = true;
  motion::Tick common = 0;
  for (const auto& [id, leg] : legs) {
    const Mcu& mcu = installation_.mcu_of(id);
    const motion::Motor& motor = installation_[id];
    const std::int64_t steps = leg.target - motor.position_steps();
    outputs |= static_cast<std::uint16_t>(1u << motor.output().value);
    one_mcu = one_mcu && &mcu == &first;
    all_by_table = all_by_table && by_table(id, steps, leg.shortest_delay);
    common = std::max(common, mcu.earliest_start(now_us, motor.output()));
  }
  if (!one_mcu) return common;
  return installation_[bus].master.earliest_common_start(now_us, first.on_bus(), outputs,
                                                         all_by_table);
}

// A jog will change, and of what is streamed only ticks that have not been run can be taken back.
bool Moves::by_table(MotorId id, std::int64_t steps, bushd_delay shortest_delay) const {
  const Mcu& mcu = installation_.mcu_of(id);
  return installation_.by_table(mcu, steps, shortest_delay) &&
         !(mcu.offers.streams && installation_[id].jogs());
}

void Moves::misses_start(MotorId id) {
  motion::Motor& motor = installation_[id];
  if (motor.is_late()) return;
  if (!starts_.waits(id) || !motor.awaits_new_start()) {
    return end(id, *motor.end(api::Outcome::kLink, motor.did_not_start()));
  }
  Mcu& mcu = installation_.mcu_of(id);
  mcu.bus().drop(mcu.on_bus(), motor.output().value);
  journal_.ended(id, "late");
  unbegun_.insert(id);
  if (motor.axis().stopping() && !motor.is_paused()) return cancel(id, "stopped before it began");
  starts_.misses(id);
}

void Moves::follow_start(MotorId id) {
  if (!starts_.waits(id) || unbegun_.contains(id)) return;
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  if (mcu.view().tick <= motor.axis().start_tick()) return;
  const bool moves = (mcu.report().moving >> motor.output().value & 1) != 0;
  const bool cancelled = motor.axis().end_tick() <= motor.axis().start_tick();
  if (moves || cancelled || motor.position_steps() != motor.axis().from_steps()) hear_of_start(id);
}

void Moves::hear_of_start(MotorId id) {
  if (!starts_.waits(id)) return;
  const motion::Axis& axis = installation_[id].axis();
  const bool cancelled = axis.end_tick() <= axis.start_tick();
  cancelled ? starts_.leaves(id) : starts_.begins(id);
}

void Moves::start_anew(std::int64_t now_us) {
  const CommonStarts::Decision decision = starts_.decide();
  for (const MotorId id : decision.end) {
    motion::Motor& motor = installation_[id];
    end(id, *motor.end(api::Outcome::kLink, motor.did_not_start()));
  }
  std::vector<FirstLeg> legs;
  for (const MotorId id : decision.again) legs.push_back({id, installation_[id].take_leg()});
  const std::map<BusId, motion::Tick> start = starts_of(now_us, legs);
  std::vector<MotorId> paused;
  for (const auto& [id, leg] : legs) {
    motion::Motor& motor = installation_[id];
    if (motor.is_paused()) paused.push_back(id);
    outputs_.log(LogLevel::kInfo, id,
                 motor.name() + ": " + motor.did_not_start() + ", and begins anew");
    motor.start(leg.target, start.at(installation_.mcu_of(id).config.bus), leg.shortest_delay);
    to_begin_.push_back(id);
  }
  if (unbegun_.size() <= kBeginsPerSlice) work();
  if (!paused.empty()) pause(now_us, paused);
}

void Moves::work() {
  for (unsigned i = 0; i < kBeginsPerSlice && begins(); ++i) begin_next();
}

void Moves::begin_next() {
  const MotorId next = to_begin_.front();
  to_begin_.pop_front();
  ++units_;
  if (unbegun_.erase(next) != 0) begin(next);
}

void Moves::end_overtaken(std::int64_t) {
  for (const MotorId id : std::set<MotorId>(unbegun_)) {
    if (installation_[id].is_late()) continue;  // its request has been carried out once
    const auto by = open_.precedence().overtaken(open_.asker_of(id)->after_stops, {id});
    if (!by) continue;
    open_.stopped_by({id}, by->by);
    cancel(id, "stopped before it began");
  }
}

// Nobody has been told of it, nor does the log of moves know of it.
void Moves::cancel(MotorId motor, const std::string& reason) {
  unbegun_.insert(motor);
  end(motor, *installation_[motor].end(api::Outcome::kStopped, reason));
}

// Whether runs may begin whose plans are made.
bool Moves::may_begin(const std::vector<MotorId>& motors) {
  for (const MotorId held_back : motors) {
    const auto may = interlocks_.may_begin(held_back);
    if (may) continue;
    for (const MotorId id : motors) cancel(id, "not begun, because " + may.error().text());
    return false;
  }
  return true;
}

void Moves::start_run(std::int64_t now_us, MotorId id, const motion::Leg& leg) {
  const BusId bus = installation_.mcu_of(id).config.bus;
  unbegun_.erase(id);  // if it was late
  starts_.begin({id});
  installation_[id].start(leg.target, start_of(now_us, bus, {{id, leg}}), leg.shortest_delay);
  begin(id);
}

void Moves::begin(MotorId id) {
  if (!may_begin({id})) return;
  motion::Motor& motor = installation_[id];
  Mcu& mcu = installation_.mcu_of(id);
  const motion::Tick start = motor.axis().start_tick();
  const std::int64_t steps = motor.axis().target_steps() - motor.axis().from_steps();
  const bool as_a_whole = by_table(id, steps, motor.axis().shortest_delay());
  journal_.started(id, steps, start, 0, as_a_whole);
  if (steps == 0) {
    end(id, *motor.end(api::Outcome::kReached, "stands at its target already"));
  } else if (as_a_whole) {
    mcu.offers.table_runs->begin_table_run(
        mcu.on_bus(), motor.output().value, start,
        {static_cast<std::int32_t>(steps), motor.axis().shortest_delay()});
  } else {
    mcu.bus().begin(mcu.on_bus(), motor.output().value, start);
  }
  installation_.changed = true;
}

void Moves::start_leg(std::int64_t now_us, MotorId id) {
  start_run(now_us, id, installation_[id].take_leg());
}

}  // namespace bushd::daemon
