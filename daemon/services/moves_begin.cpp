// How runs begin: when, whether they have, and what becomes of those that have missed their start.
#include <algorithm>
#include <map>
#include <utility>

#include "base/output_bits.h"
#include "daemon/services/moves.h"
#include "motion/report_words.h"

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
  // The new targets of those that move have the line first.
  const bool at_once = moving.empty() && starting.size() <= kBeginsPerSlice;
  const std::map<BusId, link::CommonStart> start = starts_of(now_us, starting, at_once);
  asker.answer(api::Accepted{});
  take_over(moving, asker);
  open_.open(asker, motors, OpenMoves::Purpose::kMove);
  for (const auto& [bus, of_bus] : together) starts_.begin(of_bus);
  for (const Part& part : parts) {
    motion::Motor& motor = installation_[part.motor];
    if (!motor.stands()) {
      if (motion::is_withdrawn(motor)) starts_.begin({part.motor});
      motor.aim(part.legs.front().target, part.legs.front().shortest_delay);
    } else {
      plan_start({part.motor, part.legs.front()},
                 start.at(installation_.mcu_of(part.motor).config.bus));
      unbegun_.insert(part.motor);
      to_begin_.push_back(part.motor);
    }
    motor.go_on({part.legs.begin() + 1, part.legs.end()});
    motor.ask_for(part.target);
    const auto fastest = std::ranges::min_element(part.legs, {}, &motion::Leg::shortest_delay);
    open_.planned(part.motor, static_cast<int>(part.legs.size()),
                  motor.axis().most_steps_per_s(fastest->shortest_delay));
  }
  if (to_begin_.size() <= kBeginsPerSlice) work();
  retarget(now_us, moving);
}

std::map<BusId, link::CommonStart> Moves::starts_of(std::int64_t now_us,
                                                    const std::vector<FirstLeg>& legs,
                                                    bool at_once) const {
  std::map<BusId, std::vector<FirstLeg>> of_buses;
  for (const FirstLeg& leg : legs) {
    of_buses[installation_.mcu_of(leg.motor).config.bus].push_back(leg);
  }
  std::map<BusId, link::CommonStart> start;
  for (const auto& [bus, of_bus] : of_buses) start[bus] = start_of(now_us, bus, of_bus, at_once);
  const std::size_t slices = legs.size() / kBeginsPerSlice;
  for (auto& [bus, of_bus] : start) {
    of_bus.at += static_cast<motion::Tick>(slices) * kSliceUs / installation_[bus].config.tick_us;
  }
  return start;
}

link::CommonStart Moves::start_of(std::int64_t now_us, BusId bus, const std::vector<FirstLeg>& legs,
                                  bool at_once) const {
  std::map<std::pair<McuId, link::StartMessages>, std::uint16_t> masks;
  link::CommonStart later;
  for (const auto& [id, leg] : legs) {
    const Mcu& mcu = installation_.mcu_of(id);
    const motion::Motor& motor = installation_[id];
    const std::int64_t steps = leg.target - motor.position_steps();
    // No state tells of a run with delays that are no codes.
    const link::StartMessages messages =
        by_table(id, steps, leg.shortest_delay)   ? link::StartMessages::kTableRun
        : bushd_delay_is_code(leg.shortest_delay) ? link::StartMessages::kStates
                                                  : link::StartMessages::kTicks;
    masks[{mcu.id, messages}] |= bit_of(motor.output());
    later.at = std::max(later.at, mcu.earliest_start(now_us, motor.output()));
  }
  if (!at_once) return later;
  std::vector<link::ToBegin> together;
  for (const auto& [key, motors] : masks) {
    together.push_back({installation_[key.first].on_bus(), motors, key.second});
  }
  return installation_[bus].master.earliest_common_start(now_us, together);
}

void Moves::plan_start(const FirstLeg& first, const link::CommonStart& start) {
  const auto& [id, leg] = first;
  const BusId bus = installation_.mcu_of(id).config.bus;
  if (start.to_confirm) installation_[bus].master.confirm_start(start.at);
  installation_[id].start(leg.target, start.at, leg.shortest_delay);
}

// A jog will change, and of what is streamed only ticks that have not been run can be taken back.
bool Moves::by_table(MotorId id, std::int64_t steps, bushd_delay shortest_delay) const {
  const Mcu& mcu = installation_.mcu_of(id);
  return installation_.by_table(mcu, steps, shortest_delay) &&
         !(mcu.offers.streams && installation_[id].jogs());
}

void Moves::misses_start(MotorId id) {
  motion::Motor& motor = installation_[id];
  Mcu& mcu = installation_.mcu_of(id);
  if (motion::is_late(motor)) return;
  // More time does not help against a frame that is lost now and then.
  const bool lost_once =
      starts_.is_first(id) && mcu.bus().start_was_lost(mcu.on_bus(), motor.output().value);
  if (!motion::is_withdrawn(motor) && !lost_once) mcu.bus().start_missed();
  const bool on_line = motor.is<motion::OnLine>();
  // Buses without streams miss a start for another reason than time.
  const bool may = mcu.offers.streams && (on_line || starts_.waits(id));
  if (!may || !motor.start_of_run().awaits_new()) {
    return end(id, *motor.end(api::Outcome::kLink, motor.start_of_run().missed_text()));
  }
  mcu.bus().drop(mcu.on_bus(), motor.output().value);
  journal_.ended(id, "late");
  if (motor.is_paused()) return pause_late(id);
  if (motor.stops()) return cancel(id, "stopped before it began");
  if (on_line) return;  // who leads the line begins it anew
  unbegun_.insert(id);
  starts_.misses(id);
}

void Moves::withdraw_start(std::int64_t now_us, const Bus& bus, motion::Tick at) {
  std::vector<MotorId> withdrawn;
  for (const McuId mcu : bus.mcus) {
    for (const MotorId id : installation_[mcu].motors()) {
      motion::Motor& motor = installation_[id];
      const bool begins = motor.moves() && motor.axis().start_tick() == at;
      if (begins && motor.start_of_run().withdraw()) withdrawn.push_back(id);
    }
  }
  plan(now_us, withdrawn);
}

// It stands, and resuming it begins it.
void Moves::pause_late(MotorId id) {
  unbegun_.erase(id);
  starts_.leaves(id);
  installation_[id].pause();
}

bool Moves::has_begun(MotorId id) const {
  return installation_.mcu_of(id).view().tick > installation_[id].axis().start_tick() &&
         has_moved(id);
}

bool Moves::has_moved(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  const bool moves = has_bit(mcu.report().moving, motor.output());
  return moves || motor.position_steps() != motor.axis().from_steps();
}

void Moves::follow_start(MotorId id) {
  if (!starts_.waits(id) || unbegun_.contains(id)) return;
  const motion::Axis& axis = installation_[id].axis();
  if (installation_.mcu_of(id).view().tick <= axis.start_tick()) return;
  if (has_moved(id)) return starts_.begins(id);
  const bool cancelled = axis.end_tick() <= axis.start_tick();
  if (cancelled && !motion::is_withdrawn(installation_[id])) starts_.leaves(id);
}

void Moves::start_anew(std::int64_t now_us) {
  const CommonStarts::Decision decision = starts_.decide();
  if (decision.end.empty() && decision.again.empty()) return;
  for (const MotorId id : decision.end) {
    motion::Motor& motor = installation_[id];
    end(id, *motor.end(api::Outcome::kLink, motor.start_of_run().missed_text()));
  }
  std::vector<FirstLeg> legs;
  for (const MotorId id : decision.again) legs.push_back({id, installation_[id].take_leg()});
  // Behind a large move that begins in slices there is no telling when it is their turn.
  const bool at_once = !begins() && legs.size() <= kBeginsPerSlice;
  const std::map<BusId, link::CommonStart> start = starts_of(now_us, legs, at_once);
  for (const FirstLeg& leg : legs) {
    motion::Motor& motor = installation_[leg.motor];
    outputs_.log(LogLevel::kInfo, leg.motor,
                 motor.name() + ": " + motor.start_of_run().missed_text() + ", and begins anew");
    plan_start(leg, start.at(installation_.mcu_of(leg.motor).config.bus));
    to_begin_.push_back(leg.motor);
  }
  if (to_begin_.size() <= kBeginsPerSlice) work();
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
    if (motion::is_late(installation_[id])) continue;  // its request has been carried out once
    const auto by = open_.precedence().overtaken(open_.asker_of(id)->after_stops, {id});
    if (!by) continue;
    open_.stopped_by({id}, by->by);
    cancel(id, "stopped before it began");
  }
}

// Nobody has been told of it, nor does the log of moves know of it.
void Moves::cancel(MotorId id, const std::string& reason) {
  motion::Motor& motor = installation_[id];
  const bool late = motion::is_late(motor);
  unbegun_.insert(id);
  motion::event::Ended ended = *motor.end(api::Outcome::kStopped, reason);
  ended.by_plan = late;  // as one that is stopped in motion
  end(id, ended);
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
  plan_start({id, leg}, start_of(now_us, bus, {{id, leg}}, true));
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
