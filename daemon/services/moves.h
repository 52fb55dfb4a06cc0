// Moves: from a request by a run per motor to its result. Here is also what every other service
// needs of motors that have a plan: stopping them, and doing what follows from their reports.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/common_starts.h"
#include "daemon/services/dry_run.h"
#include "daemon/services/journal.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class Moves final : public Service {
 public:
  // To begin a motor's move takes some microseconds, its line for the log of moves above all. So a
  // move of more motors than this is begun in slices of as many.
  static constexpr unsigned kBeginsPerSlice = 32;

  Moves(Installation& installation, const Interlocks& interlocks, Journal& journal,
        OpenMoves& open_moves, DryRuns& dry_runs, Outputs& outputs)
      : installation_(installation),
        interlocks_(interlocks),
        journal_(journal),
        open_(open_moves),
        dry_runs_(dry_runs),
        outputs_(outputs),
        starts_(installation.motors().size()) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::Move& move);

  // Checks where a motor of a request may go, "NAME: WHY" if not. A distance counts from
  // motion::Motor::distance_from. The steps of it are `whole`.
  Result<units::Steps> target_of(MotorId motor, const api::Amount& amount, api::Move::Kind kind,
                                 bushd_delay shortest_delay) const;
  // motion::Motor::shortest_delay_at, "NAME: WHY" if there is none.
  Result<bushd_delay> shortest_delay_of(MotorId motor,
                                        const std::optional<api::Speed>& speed) const;

  // Opens a motion of one motor, from rest or in place of what it does. Precondition: it may.
  void jog(std::int64_t now_us, const api::Asker& asker, MotorId motor, std::int64_t target,
           bushd_delay shortest_delay);
  // Gives an open motion that jog() has opened another target. Precondition: the motor moves.
  void redirect(std::int64_t now_us, MotorId motor, std::int64_t target,
                bushd_delay shortest_delay);

  // Those that move ramp down and stay in their moves, until they are resumed or stopped.
  void pause(std::int64_t now_us, const std::vector<MotorId>& motors);
  void resume(std::int64_t now_us, const std::vector<MotorId>& motors);
  // Begins the runs of the motors of a line, which the caller has planned and started: at one tick,
  // or with `pace` each at a tick of its own bus. Precondition: they are part of an open move.
  void begin_on_line(const std::vector<MotorId>& motors,
                     const std::shared_ptr<link::LinePace>& pace = nullptr);
  // Gives these runs the other end or speed that the caller has planned.
  void redirect_on_line(std::int64_t now_us, const std::vector<MotorId>& motors);
  // Ends their moves without stopping the motors: a request of `by` moves them on.
  void take_over(const std::vector<MotorId>& motors, const api::Asker& by);

  // Begins a move from rest to this position, as the second part of a request that is open already.
  // Returns the position in steps.
  Result<std::int64_t> go_on(std::int64_t now_us, MotorId motor, const api::Amount& position);

  // Ramps down those that move, and disarms those that wait for the trigger.
  void stop(std::int64_t now_us, const std::vector<MotorId>& motors);
  // Sends the MCUs the present plans of these motors, and of others on their lines. They replace
  // changes that the MCUs have not taken yet.
  void replan(std::int64_t now_us, const std::vector<MotorId>& motors);
  // The same for these motors alone, whose MCUs have not taken the change.
  void plan_again(std::int64_t now_us, const std::vector<MotorId>& motors);
  // Does what follows from a report of a motor.
  void take(std::int64_t now_us, MotorId motor, const std::vector<motion::Event>& events);
  // Its MCU had not got the first ticks in time, so it has not moved. If no motor that was to begin
  // with it has, all of them begin anew; else it ends.
  void misses_start(MotorId motor);
  // Those that were to begin together at this tick of the bus are given rest instead, and miss it.
  void withdraw_start(std::int64_t now_us, const Bus& bus, motion::Tick at);
  void end(MotorId motor, const motion::event::Ended& ended);
  // Whether a motor that moves has begun its run, as its MCU reports.
  bool has_begun(MotorId motor) const;

  // Whether motors of an accepted move are still to begin. Until then requests should wait, but
  // for stops.
  bool begins() const { return !to_begin_.empty(); }
  // Begins one slice of these motors.
  void work();
  // Motors' moves begun so far.
  std::uint64_t units() const { return units_; }

  // When all that moves now will have come to rest, as planned.
  std::int64_t rest_by_us(std::int64_t now_us) const;

  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

  // Whether it would be taken, as its motors stand now.
  bool would_take(const api::Move& move) const { return parts_of(move).has_value(); }

 private:
  struct Part {
    MotorId motor;
    units::Steps target;            // for motion::Motor::ask_for
    std::vector<motion::Leg> legs;  // at least one
  };
  Result<std::vector<Part>> parts_of(const api::Move& move) const;
  // moves_plan.cpp
  void plan(std::int64_t now_us, const std::vector<MotorId>& motors);
  std::map<BusId, std::vector<link::ToReplace>> replacements_of(
      const std::vector<MotorId>& motors) const;
  std::map<McuId, motion::Tick> ticks_to_change_at(std::int64_t now_us,
                                                   const std::vector<MotorId>& motors) const;
  // Buses that keep pace have ticks of their own, which are counted from the beginning of the line:
  // makes the ticks of a line's motors in `at` equally far from it.
  void at_one_tick_of_line(const std::vector<MotorId>& motors,
                           std::map<McuId, motion::Tick>& at) const;
  // Where motors stop on their line, in its steps, if another one of the line stops farther on.
  std::map<MotorId, std::uint32_t> common_ends(const std::vector<MotorId>& motors) const;
  std::vector<MotorId> with_whole_lines(const std::vector<MotorId>& motors);
  bool has_time_to_retarget(std::int64_t now_us, MotorId motor) const;
  void start(std::int64_t now_us, const api::Asker& asker, const std::vector<Part>& parts);
  Result<Part> part_of(MotorId motor, const api::Amount& amount, const api::Move& move) const;
  void start_leg(std::int64_t now_us, MotorId motor);
  // When these motors, at rest there, can begin their first legs together on each bus; `at_once`:
  // as soon as what is told of them allows.
  struct FirstLeg {
    MotorId motor;
    motion::Leg leg;
  };
  std::map<BusId, link::CommonStart> starts_of(std::int64_t now_us,
                                               const std::vector<FirstLeg>& legs,
                                               bool at_once) const;
  link::CommonStart start_of(std::int64_t now_us, BusId bus, const std::vector<FirstLeg>& legs,
                             bool at_once) const;
  // Plans the run of a motor that is to begin then.
  void plan_start(const FirstLeg& leg, const link::CommonStart& start);
  // Whether its MCU is given the run as a whole.
  bool by_table(MotorId motor, std::int64_t steps, bushd_delay shortest_delay) const;
  // Whether a motor has begun, as its MCU reports.
  void follow_start(MotorId motor);
  bool has_moved(MotorId motor) const;
  void pause_late(MotorId motor);
  void start_anew(std::int64_t now_us);
  // From rest; the motor is part of an open move.
  void start_run(std::int64_t now_us, MotorId motor, const motion::Leg& leg);
  // Its plan is made: it is logged, and its MCU gets it. One that may not begin now ends.
  void begin(MotorId motor);
  bool may_begin(const std::vector<MotorId>& motors);
  void begin_next();
  void cancel(MotorId motor, const std::string& reason);
  // Motors with another target: as soon as the line has time for it, and to the newest one only.
  void retarget(std::int64_t now_us, const std::vector<MotorId>& motors);
  void disarm(const std::vector<MotorId>& motors);
  void cancel_armed_group(MotorId motor);

  Installation& installation_;
  const Interlocks& interlocks_;
  Journal& journal_;
  OpenMoves& open_;
  DryRuns& dry_runs_;
  Outputs& outputs_;
  std::set<MotorId> to_retarget_;  // waiting for the line
  CommonStarts starts_;
  std::set<MotorId> unbegun_;     // planned and not yet begun, or late
  std::deque<MotorId> to_begin_;  // these, in their order, and some that were cancelled
  std::uint64_t units_ = 0;
};

}  // namespace bushd::daemon
