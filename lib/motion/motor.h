// One motor: where it stands and whether that is certain, what it does, and what it may do now.
// Requests and reports of its MCU go in; what is to be done on the bus and to be told to clients
// comes out. It has no I/O and knows no other motor.
//
// Its parts have a purpose each: scale() what its numbers mean, trust() what its position is worth,
// hold() whether motions may begin, reach() where it may go, line() its runs on a line with others,
// start_of_run() what becomes of a start that comes too late.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/ids.h"
#include "base/result.h"
#include "base/units/coordinates.h"
#include "engine/message.h"
#include "motion/axis.h"
#include "motion/motor_hold.h"
#include "motion/motor_line.h"
#include "motion/motor_reach.h"
#include "motion/motor_scale.h"
#include "motion/motor_start.h"
#include "motion/motor_trust.h"
#include "words/amount.h"
#include "words/words.h"

namespace bushd::motion {

using words::Outcome;

struct MotorSetup {
  std::string name;
  std::string mcu;  // for texts, as the name
  Output output;
  bool has_home = false;
  bool restored_refused = false;  // it may not move while its position is only restored
  // Without a ramp, so that it may overrun; with drivers disabled or not.
  bool limit_immediate = false;
  bool emergency_stop_immediate = false;
  bool emergency_input_immediate = false;
  MotorScale scale{};
  double backlash = 0;  // user units; its sign is that of the last approach; 0: from either side
  std::optional<double> backlash_speed{};  // user units/s, of the last approach
  Tick settle_ticks = 0;                   // it has ended when it has stood for so long
};

// What a motor does. Any other than Resting keeps other motions away from it.
struct Resting {};
struct Moving {
  bool position_mismatch = false;  // counted otherwise than planned; it is being stopped
  int limit = 0;                   // +1, -1: its limit switch at this end stops it
  Tick stood_since = 0;            // seen to stand after a ramp of its MCU's own, which led there
  std::uint8_t faults = 0;         // with which its MCU runs it down
  bool by_others = false;  // is stopped since others on its way have ended: nobody has asked for it
  bool late = false;       // has missed its start: it stands until it is started again, or ends
  bool withdrawn = false;  // is not to begin at its start, but later, together with others
};
struct Homing {};  // by its MCU, or it waits for its turn
// Moves on a line with others. Whoever leads the line begins its runs, all at the same ticks.
struct OnLine : Moving {
  std::uint64_t line = 0;         // its number
  std::int64_t target_steps = 0;  // where its last run leads
  bool last_run = true;
  bool to_point = true;  // this run leads where the line, or its leg, is to end
  bool stands = false;   // where a run has led that was not the last one
  bool resumes = false;  // paused, and to go on as soon as all motors of the line stand
};
// Waits for the trigger, or for the MCU to say that it does: the axis has no start yet.
struct Armed {
  std::uint8_t number;  // of link::Trigger::arm
  std::int64_t steps;
  bool confirmed = false;                 // the MCU has said that it waits
  bool stops = false;                     // as soon as it has started: that came before disarming
  std::optional<std::string> ended_by{};  // why, if nobody has asked for that
  std::optional<OnLine> on_line{};        // what it is from its start on, in place of Moving
};
struct Local {};       // the inputs at its MCU move it, or another master does
struct Travelling {};  // by its MCU, between its limits or for one step, or it is about to
struct InProgram {};   // a program of its MCU controls it, also at rest, or is about to
using Activity = std::variant<Resting, Moving, Armed, Homing, Local, OnLine, Travelling, InProgram>;
// The MCU moves the motor by itself, as it was asked to.
template <class How>
concept OfMcu =
    std::same_as<How, Homing> || std::same_as<How, Travelling> || std::same_as<How, InProgram>;

// What an MCU reports, and what is known beside.
struct Report {
  const bushd_report& of_mcu;
  Tick tick;                  // of_mcu.tick, unwrapped
  bool requests_open;         // the MCU has not yet answered all that it was asked
  bool emergency_stop_open;   // commanded, and not yet known to be obeyed everywhere
  bool other_master = false;  // talks on the bus, and may have moved it
};

// What follows from a report, to be done in this order.
namespace event {
struct Waits {};  // for the trigger: an edge from now on starts it
struct Started {  // by the trigger: from now on it is a table run like any other
  Tick start;
  std::uint32_t late_ns;
  std::int64_t steps;
};
struct Executed {  // a change of plan
  Change change;
};
struct Replan {};  // the plan is not what was requested any more
struct Drop {};    // its MCU takes no more ticks for this motion
struct Mismatch {
  bool stopped = true;  // by its plan; else it is left to another master
};
struct MissedStart {};  // its MCU had not got its first ticks in time; it did not move
struct Turn {};         // it stands on the way to a target that takes a second run
struct NextLeg {};      // it stands where a leg has led, and another one follows
struct Paused {};       // it stands where it was to pause
struct StandsOnLine {   // and its motion goes on when all motors of the line stand
  bool at_target;
};
struct Ended {
  Outcome outcome;
  std::string reason;
  bool was_armed = false;
  bool was_paused = false;  // and stood
  bool by_plan = false;     // at the target, or where it was stopped on request
};
}  // namespace event
using Event = std::variant<event::Waits, event::Started, event::Executed, event::Replan,
                           event::Drop, event::Mismatch, event::MissedStart, event::Turn,
                           event::NextLeg, event::Paused, event::StandsOnLine, event::Ended>;

class Motor {
 public:
  static constexpr std::int64_t kMaxPosition = MotorScale::kMaxPosition;

  Motor(MotorSetup setup, Axis axis) : setup_(std::move(setup)), axis_(axis), trust_(setup_.mcu) {}

  const std::string& name() const { return setup_.name; }
  Output output() const { return setup_.output; }

  // What its numbers mean.
  MotorScale& scale() { return setup_.scale; }
  const MotorScale& scale() const { return setup_.scale; }
  // What its position is worth. What follows from reports it is told here.
  MotorTrust& trust() { return trust_; }
  const MotorTrust& trust() const { return trust_; }
  // Whether motions of it are held back.
  MotorHold& hold() { return hold_; }
  const MotorHold& hold() const { return hold_; }

  template <class A>
  const A* as() const {
    return std::get_if<A>(&activity_);
  }
  template <class A>
  bool is() const {
    return std::holds_alternative<A>(activity_);
  }
  // It moves, alone or on a line.
  const Moving* moving() const {
    const OnLine* on_line = as<OnLine>();
    return on_line != nullptr ? on_line : as<Moving>();
  }
  bool moves() const { return moving() != nullptr; }
  // Its axis has a plan: it moves, or will when the trigger comes.
  bool has_plan() const { return moves() || is<Armed>(); }

  // As reported last.
  std::int64_t position_steps() const { return position_; }
  // Where it will stand when all is done, and it has been resumed if it is paused. Where it is, as
  // long as nobody has said where it is to stand.
  std::int64_t target_steps() const;
  // Where it was told to go last, while it is there or bound for it.
  const std::optional<units::Steps>& asked_for() const { return asked_for_; }

  // The plan; only while has_plan(). Another table without a plan only.
  Axis& axis() { return axis_; }
  const Axis& axis() const { return axis_; }

  // What it may do now.
  MotorReach reach() const { return MotorReach(*this); }
  // Its runs on a line with others.
  MotorLine line() { return MotorLine(*this); }
  // Whether the run that it was given begins at its start.
  MotorStart start_of_run() { return MotorStart(*this); }

  // Requests. Preconditions: it may. Shortest delays are those of Axis.
  // From rest, or from the turning point of a motion.
  void start(std::int64_t target, Tick start, bushd_delay shortest_delay = 0);
  void aim(std::int64_t target, bushd_delay shortest_delay = 0);
  // Where all requests so far lead; nothing: nobody has said that in numbers.
  void ask_for(std::optional<units::Steps> target) { asked_for_ = target; }
  // From rest, along a trajectory whose first row is where it stands.
  void follow(TrajectoryShare share, Tick start);
  // Replaces what comes after the present run.
  void go_on(std::vector<Leg> legs) { further_ = std::move(legs); }
  // Removes and returns the leg that is to be made from where it stands: the rest of the one that
  // it makes, also if it has missed its start, or the next one.
  Leg take_leg();
  // Ramps down a moving motor; its motion stays open.
  void pause();
  // Continues; by another run if it stands already. On a line it comes to rest first.
  void resume();
  bool is_paused() const { return pause_ == Pause::kRamps || stands_paused(); }
  bool stands_paused() const { return pause_ == Pause::kStands; }
  // start() is for it, not aim().
  bool stands() const;
  // Its motion goes on until somebody ends it: where its runs lead nobody has asked for.
  bool jogs() const { return jogs_; }
  void set_jogs(bool now) {
    jogs_ = now;
    if (now) asked_for_.reset();
  }
  void arm(std::uint8_t number, std::int64_t steps, bushd_delay shortest_delay = 0);
  // Moving: ramps down. Armed: as soon as it starts, if the trigger comes before it is disarmed;
  // `ended_by`: why, if nobody has asked for it.
  void stop(std::optional<std::string> ended_by = {});
  // It was stopped, and nobody has asked for that. At its target it settles. Nothing if the stop
  // took its start back, so that it does not move.
  void is_stopped_by_others() {
    if (moves()) moving_now().by_others = true;
  }
  // Somebody has stopped it, or paused it.
  bool stops() const;
  // Its MCU moves it by itself from now on, or is about to: Homing, Travelling or InProgram.
  template <OfMcu How>
  void give_to_mcu(How how);
  // It no longer does that. Nothing if it does something else.
  template <OfMcu How>
  void take_from_mcu(How) {
    if (is<How>()) rest();
  }

  // Its MCU is configured and in step: for the first time, or again; `restarted` if positions do
  // not go on from before.
  void goes_online(const bushd_report& report, bool first, bool restarted);
  // `heard_utime_us`: when its MCU reported last. `moved_by_people`: they may move it by the inputs
  // at its MCU. To be told while its motion has not been ended.
  void goes_offline(std::int64_t heard_utime_us, bool moved_by_people);
  std::vector<Event> report(const Report& report);
  // Its motion is over, if there is one.
  std::optional<event::Ended> end(Outcome outcome, std::string reason);

 private:
  friend class MotorLine;
  friend class MotorReach;
  friend class MotorStart;

  static constexpr Tick kNever = INT64_MAX / 2;  // the start of what waits for the trigger

  bool rests_in_pause() const { return pause_ == Pause::kStands || pause_ == Pause::kOver; }
  bool forbidden(int direction) const { return direction > 0 ? forbidden_up_ : forbidden_down_; }
  Moving& moving_now() { return const_cast<Moving&>(*moving()); }
  void follow_withdrawn();
  void follow_end_of_run(const Report& report, std::vector<Event>& events);
  Tick settled_from(Tick end) const;
  void follow_end_of_line(const Report& report, std::vector<Event>& events);
  bool stops_immediately(const bushd_report& report) const;
  void uncertain_if_stopped_immediately(const bushd_report& report);
  void take_limits(const bushd_report& report);
  void follow(const Report& report, std::vector<Event>& events);
  bool follow_armed(const Report& report, std::vector<Event>& events);
  void notice_limit(const Report& report, std::vector<Event>& events);
  bool stands_at_target() const;
  bool awaits_plan_at_limit(const Report& report) const;
  bool ends_by_plan_at_limit(const Report& report, std::vector<Event>& events);
  event::Ended end_at_limit();
  event::Ended end_by_fault(const bushd_report& report);
  event::Ended reached();
  event::Ended stopped();
  event::Ended ran_out();
  event::Ended ended(Outcome outcome, std::string reason);
  // The MCU has moved it from there, by itself or unseen: as far as it is counted, or not.
  void follow_count(std::int64_t before);
  void follow_autonomous(const bushd_report& report, bool moved_without_plan);
  void rest();
  void follow_asked_for();

  MotorSetup setup_;
  Axis axis_;
  MotorTrust trust_;
  MotorHold hold_;
  Activity activity_;
  std::vector<Leg> further_;                         // after the run that it makes
  enum class Pause { kNo, kRamps, kStands, kOver };  // kOver: stopped where it stood
  Pause pause_ = Pause::kNo;
  bool jogs_ = false;
  std::optional<units::Steps> asked_for_;
  std::int64_t position_ = 0;
  bool autonomous_ = false;  // as reported last: its MCU moves it by itself
  bool moved_by_other_ =
      false;  // as reported last: it has moved and still does, without a plan here
  bool forbidden_up_ = false;
  bool forbidden_down_ = false;
};

template <OfMcu How>
void Motor::give_to_mcu(How how) {
  activity_ = how;
  asked_for_.reset();
}

std::string busy_text(const Motor& motor);  // "theta moves"

inline bool is_late(const Motor& motor) {
  return motor.moves() && motor.moving()->late;
}
inline bool is_withdrawn(const Motor& motor) {
  return motor.moves() && motor.moving()->withdrawn;
}

// It moves along a trajectory.
inline bool follows_trajectory(const Motor& motor) {
  return motor.moves() && motor.axis().trajectory().has_value();
}

// `boot_number`: of its MCU now.
inline PositionTrust position_trust(const Motor& motor, std::optional<std::uint16_t> boot_number) {
  return motor.trust().judged(boot_number, motor.position_steps(), motor.scale().coordinates());
}

}  // namespace bushd::motion
