// Compares what the daemon says with what the motors did. Knows the plant, the commands sent, the
// replies and the states; nothing of the daemon's or the MCUs' inner life but boot numbers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/snapshot.h"
#include "arrivals.h"
#include "beginnings.h"
#include "config/config.h"
#include "crate_model.h"
#include "mcu_program.h"
#include "positions.h"
#include "promise.h"
#include "recent.h"
#include "request.h"
#include "shutter_model.h"
#include "sim/bus.h"
#include "sim/plant.h"
#include "starts.h"
#include "units.h"

namespace bushfaults {

struct Violation {
  bushd::sim::TimeNs time_ns;
  std::string what;
};

class Witness {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // All of them outlive the witness.
  Witness(const bushd::config::Config& config, const bushd::sim::Bus& bus,
          const bushd::sim::Plant& plant, Recent& recent);

  void violated(TimeNs now_ns, const std::string& what);
  const std::optional<Violation>& violation() const { return violation_; }  // the first

  void daemon_ends(TimeNs now_ns);     // it has been asked to, and begins nothing any more
  void daemon_started(TimeNs now_ns);  // what clients had asked of the one before is void
  // A second daemon talks on the bus: it may take MCUs over, and with them what they move.
  void second_daemon(TimeNs now_ns) {
    second_ns_ = now_ns;
    beginnings_.other_daemon();
  }
  void mcu_reset(std::size_t mcu);
  // It has received a frame for it, of whoever.
  void is_heard(TimeNs now_ns, std::size_t mcu) { heard_ns_[mcu] = now_ns; }
  // A program that a daemon before has run, or whose MCU was lost, may be under way.
  bool program_may_go_on() const;
  // Its limit switch is, or was until now, active.
  void pressed(TimeNs now_ns, std::size_t motor);
  // At the daemon, where it may wait for its turn.
  void arrives(const Request& request);
  // Before the core gets it; after that come the replies that it makes at once.
  void carried_out(TimeNs now_ns, const Request& request);
  // `kind`: index in api::Request of what it answers.
  void reply(TimeNs now_ns, const Key& key, std::size_t kind, const bushd::api::Reply& reply);
  void state(TimeNs now_ns, std::size_t mcu, const bushd::api::StateSnapshot& state);
  void description(TimeNs now_ns, const bushd::api::Description& said);
  void log(const std::string& text);
  void lam(TimeNs now_ns, const bushd::api::CamacLam& lam);
  // A run of this motor begins, one of a line or of its own, or has ended as this word says. One
  // that has waited for the trigger may be under way already.
  struct Run {
    bool on_line;
    bool waited;
  };
  std::function<void(TimeNs now_ns, std::size_t mcu, std::size_t output, Run run)> on_run;
  std::function<void(TimeNs now_ns, std::size_t mcu, std::size_t output, const std::string& word)>
      on_run_end;
  // From time to time; the plant has come to now_ns.
  void watch(TimeNs now_ns);
  // A line of the log of moves: there each motor of a group ends by itself.
  void move_log(TimeNs now_ns, const std::string& json_line);
  // Accepted commands that should have had their result by now.
  void check_deadlines(TimeNs now_ns);

  // As the daemon said last, by MCU; empty before it has said anything in this life.
  const std::vector<std::optional<bushd::api::StateSnapshot>>& states() const { return states_; }
  // Whether it can be READY at all.
  void expect(std::size_t mcu, bool present) { present_[mcu] = present; }
  bool all_ready() const;
  std::string not_ready() const;  // which MCUs, and why
  bool commands_open() const;

  Promise& promise() { return promise_; }
  const Promise& promise() const { return promise_; }
  void trigger(TimeNs now_ns, std::size_t mcu, bool rising);
  // The motor of the shutter has made a step, and stands there as the plant counts.
  void shutter_stepped(TimeNs now_ns, bool right, std::int64_t stands);
  // Clients have stopped all, and all is well.
  void calm() { shutter_.calm(); }
  const Crates& crates() const { return crates_; }
  const ShutterModel& shutter() const { return shutter_; }
  // Offsets are kept over restarts of the daemon.
  void keep_offsets() { offsets_kept_ = true; }
  const Units& units() const { return units_; }
  Positions& positions() { return positions_; }
  const Positions& positions() const { return positions_; }
  const std::map<std::string, std::uint64_t>& homings_by_result() const {
    return homings_by_result_;
  }
  const std::map<std::string, std::uint64_t>& moves_by_result() const { return moves_by_result_; }
  const std::map<std::string, std::uint64_t>& jogs_by_result() const { return jogs_by_result_; }
  // Runs of programs of MCUs; those that were reached, and were judged by where they lead.
  const std::map<std::string, std::uint64_t>& programs_by_result() const {
    return programs_by_result_;
  }
  std::uint64_t programs_judged() const { return programs_judged_; }
  // Last approaches that were made, of moves of two legs.
  std::uint64_t approaches() const { return approaches_; }
  std::uint64_t times_paused() const { return times_paused_; }
  std::uint64_t steps_commanded() const { return steps_commanded_; }
  // Lines and paths that were reached, those of them that MCUs changed at different ticks, how far
  // apart these were at most, and how many steps motors were off the others.
  std::uint64_t ways() const { return ways_; }
  std::uint64_t ways_apart() const { return ways_apart_; }
  std::int64_t most_ticks_apart() const { return most_ticks_apart_; }
  double worst_off_way() const { return worst_off_way_; }
  // Between the last states and the motors, where the daemon claims to know.
  std::uint64_t steps_unaccounted() const;

 private:
  using Motors = std::vector<bushd::api::MotorResult>;
  struct End {
    std::string word;  // of the result
    std::int64_t position_steps;
    std::int64_t stands = 0;   // as the plant counts
    bool moves_on = false;     // by another move; then nobody knows where exactly that began
    bool paused = false;       // it may be no end, and no other line be written when it comes
    bool legs_follow = false;  // it may be no end: the next leg may not be begun
    bool agrees(const bushd::api::MotorResult& result) const;
  };
  struct Range {
    std::int64_t low;
    std::int64_t high;
    TimeNs since_ns;
  };
  struct Motor {
    std::string name;
    std::size_t mcu;
    std::size_t output;
    std::int64_t own_ramp_excess;        // steps beyond its plan, if its MCU ramps it down
    std::optional<TimeNs> pressed_ns{};  // when its limit switch was active last
    std::optional<Key> move{};           // accepted, and this motor's part of it perhaps not ended
    // Where it leads, as the plant counts; nothing after a stop.
    std::optional<std::int64_t> target{};
    // How its last run ended is told. Unless it is paused, so has its part: another leg begins at
    // once.
    bool over = false;
    bool goes_on = false;            // another run of its part may begin
    bool stops = false;              // somebody has stopped it
    bool pauses = false;             // somebody has paused it, and nobody resumed it
    std::optional<Key> paused_by{};  // the last time
    // Where its run began, if it began at rest.
    std::optional<std::int64_t> run_from{};
    std::optional<Range> range{};  // that it does not leave, as the plant counts
    bool held = false;
    std::optional<Key> held_by{};  // the last time
    bool held_on_disk = false;     // as that has been answered
    TimeNs set_ns = -1;            // when somebody said where it stands, the last time
    int idle_checks = 0;           // of the deadlines, while no motion of it was open
    std::optional<std::int64_t> held_at{};
    std::int64_t watched_at = 0;     // where it stood when it was watched last
    std::optional<Key> program{};    // the run of it in which it is
    bool program_may_go_on = false;  // it was in one, and nobody knows whether that has ended
    TimeNs asked_ns = -1;            // when somebody asked for a motion of it, the last time
    std::optional<std::int64_t> stopped_at{};  // where it stood when a stop was done, until then
    void is_asked_for(TimeNs now_ns) {
      asked_ns = now_ns;
      stopped_at.reset();
    }
    bool moves() const { return move && !over; }
    bool stands_paused() const { return move && over && pauses; }
  };
  // The request that has begun to jog.
  struct JogOpen {
    TimeNs renewed_ns;
    std::int64_t keepalive_ms;
    std::int64_t shortest_delay_ns;            // of the fastest of its speeds
    bool let_go = false;                       // by its client, which has not begun again
    std::optional<std::int64_t> ends_after{};  // steps, from here:
    std::int64_t ends_from = 0;
  };
  struct Asked {
    Request request{};
    TimeNs since_ns = 0;
    TimeNs due_since_ns = 0;  // or since it was resumed
    bool accepted = false;
    bool finished = false;  // refused, or its result has come
    // By motor, for moves: where the plant stood (nothing if it moved) and must stand in the end,
    // how it ended, and when it made its first step, if it began at rest, did and ended as planned.
    std::vector<std::optional<std::int64_t>> from{};
    std::vector<std::optional<std::int64_t>> target{};
    std::vector<std::optional<End>> end{};
    std::vector<std::optional<TimeNs>> first_step_ns{};
    std::vector<bool> began{};  // one that waits for the trigger may not
    // Where its legs must end, as the plant counts, and which one it makes; none: not known.
    std::vector<std::vector<std::int64_t>> legs{};
    std::vector<std::size_t> leg{};
    std::vector<bool> told{};   // how a run of it ended
    std::vector<bool> stops{};  // somebody has stopped it
    std::optional<JogOpen> jog{};
    std::vector<std::int64_t> polyline{};  // row by row, from where they stood, as the plant counts
    double off_way = 0;                    // at most, so far
    // By motor: at which ticks its MCU has taken a pause, or another speed or end, since all stood
    // at one place of the way; how far apart MCUs have been before that, and how many runs have
    // begun now.
    std::vector<std::vector<std::int64_t>> changed_at{};
    std::int64_t most_ticks_apart = 0;
    TimeNs runs_begun_ns = -1;
    std::size_t runs_begun = 0;
    bool way_is_over = false;  // a motor of it, which has ended, moves for somebody else
    std::vector<std::uint64_t> changes{};             // of settings
    std::vector<std::optional<bool>> outside{};       // of its new limits; nothing: it is not known
    std::vector<std::vector<McuProgram>> programs{};  // that it runs: what each may be
    std::size_t index_of(const std::string& motor) const {
      const auto& all = request.motors;
      return static_cast<std::size_t>(std::find(all.begin(), all.end(), motor) - all.begin());
    }
  };

  const Motor* find(const std::string& name) const;
  Motor* find(const std::string& name);
  std::int64_t plant_steps(const Motor& motor) const {
    return plant_.position_steps(motor.mcu, motor.output);
  }
  std::size_t index_of(const Motor& motor) const {
    return static_cast<std::size_t>(&motor - motors_.data());
  }
  // Plant's count minus daemon's.
  std::optional<std::int64_t> offset(const Motor& motor) const {
    return positions_.offset(index_of(motor));
  }
  void accepted(TimeNs now_ns, const Key& key, Asked& asked);
  void refused(const Asked& asked);
  void finished(TimeNs now_ns, const Key& key, const Asked& asked,
                const bushd::api::Completed& result);
  void over_at_once(TimeNs now_ns, const Key& key, Asked& asked,
                    const bushd::api::Completed& result);
  void position_set(const Request& request, const bushd::api::Completed& completed);
  void moved(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result,
             const Motors& motors);
  void homed(TimeNs now_ns, const Asked& asked, const Motors& motors);
  void forget_some();
  // In steps of the daemon's count. Nothing: it is not known.
  std::optional<std::int64_t> position_asked(const Request& request, std::size_t i) const;
  std::int64_t distance_asked(const Request& request, std::size_t i) const;
  static bool sets_offset(const Units& units, std::size_t motor, const Request& request);
  void position_accepted(const Request& request, std::size_t i);
  void check_limits(TimeNs now_ns, const Asked& asked);
  void check_refusal(TimeNs now_ns, const Asked& asked, const std::string& reason);
  std::optional<std::int64_t> target_asked(const Motor& motor, const Request& request,
                                           std::size_t i) const;
  bool trusted(const Motor& motor) const;
  std::int64_t said_steps(const Motor& motor) const;
  bool refused_for_good_reason(const Asked& asked, const Motor& motor, std::size_t i,
                               const std::string& reason) const;
  void check_speed(TimeNs now_ns, const Motor& motor, const Asked& asked, std::size_t index);
  void check_home_speed(TimeNs now_ns, const Asked& asked, std::size_t index);
  std::optional<std::int64_t> base_of(const Motor& motor) const;
  void check_approach(TimeNs now_ns, const Motor& motor, const Asked& asked, std::size_t index);
  void check_settled(TimeNs now_ns, const Motor& motor, const Asked& asked);
  // Where the legs of a move there must end, in the plant's count.
  std::vector<std::int64_t> legs_to(const Motor& motor, const Request& request,
                                    std::int64_t target) const;
  void accepted_motion(TimeNs now_ns, const Key& key, Asked& asked, std::size_t i);
  bool waits_for_trigger(const Motor& motor) const;
  void forget_unbegun(Motor& motor);
  void take_over(TimeNs now_ns, Motor& motor, const Key& by, std::optional<std::int64_t> target);
  void keep_within(TimeNs now_ns, Motor& motor);
  // Motors on one way, along a line or a path.
  void begin_way(Asked& asked);
  void watch_ways();
  static void run_of_way_begins(TimeNs now_ns, Asked& asked);
  void run_changed(const Motor& motor, std::int64_t tick);
  void check_way(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result);
  void run_begins(TimeNs now_ns, Motor& motor);
  void disarm_accepted(const Request& request);
  void pause_with_others(Motor& motor, const Asked& asked);
  void run_ended(TimeNs now_ns, Motor& motor, End end);
  void check_end(TimeNs now_ns, const Motor& motor, const Asked& asked, const End& end,
                 std::optional<std::int64_t> target);
  // Jogs, pauses and settings.
  void jog_accepted(TimeNs now_ns, const Key& key, Asked& asked);
  Asked* open_jog(const Motor& motor);
  void jogged(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result);
  void check_jog_end(TimeNs now_ns, const Motor& motor, const Asked& asked,
                     const bushd::api::Completed& result);
  void check_steps_after(TimeNs now_ns, const Motor& motor, const Asked& asked,
                         const std::string& reason);
  // What is asked of one motor of a line is asked of all.
  bool concerns(const Request& request, const Motor& motor) const;
  void stop_accepted(const Request& request);
  void stop_is_done(const Asked& asked, const std::string& reason);
  void pause_accepted(TimeNs now_ns, const Request& request);
  void hold_accepted(const Request& request);
  void hold_done(const Key& key, const bushd::api::Completed& result);
  void paused(TimeNs now_ns, const Key& key, const std::string& reason);
  // Programs of MCUs.
  void put_accepted(const Request& request);
  void put_finished(const Request& request, const bushd::api::Completed& result);
  void programs_accepted(TimeNs now_ns, const Key& key, Asked& asked);
  void programs_ended(TimeNs now_ns, const Key& key, const Asked& asked,
                      const bushd::api::Completed& result);
  void program_ended(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result,
                     std::size_t first, const std::vector<McuProgram>& texts);
  void leave_program(TimeNs now_ns, Motor& motor, const Request& request);
  void forget_programs();
  bool goes_on_alone(const Motor& motor) const;
  // CAMAC modules, which ask for motion themselves.
  void asked_by_module(TimeNs now_ns, const std::string& client, const std::string& what,
                       const std::string& motor);
  void shutter_moves(TimeNs now_ns, Motor& motor);
  void asks(TimeNs now_ns, const Request& request);
  void crate_answered(TimeNs now_ns, const Request& request, const bushd::api::CamacResult& result);
  bool is_shutter(const Motor& motor) const {
    return ShutterPlace::motor(config_) == bushd::MotorId{index_of(motor)};
  }
  bool is_of_shutter_module(const Motor& motor) const {
    return motor.move && std::get<1>(*motor.move) == ShutterModel::kClient;
  }
  void module_moves(TimeNs now_ns, Motor& motor, const Crates::Accepted& accepted, bool on_line);
  void module_ended(TimeNs now_ns, Motor& motor, const End& end, bool whole);
  void check_program(TimeNs now_ns, const Motor& motor, TimeNs shortest_delay_ns);
  bool is_of_module(const Motor& motor) const {
    return motor.move && std::get<1>(*motor.move) == Crates::kBushd2Client;
  }
  void configure_accepted(Asked& asked);
  void configured(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result);
  void check_deadline(TimeNs now_ns, const Key& key, Asked& asked);

  const bushd::config::Config& config_;
  const bushd::sim::Plant& plant_;
  Recent& recent_;
  Arrivals arrivals_;
  Beginnings beginnings_;
  Positions positions_;
  Starts starts_;
  Units units_;
  Crates crates_;
  ShutterModel shutter_;
  std::optional<ProgramMotion> program_;  // that a module's motor moves by, if it is known
  std::int64_t module_moves_ = 0;
  bool offsets_kept_ = false;
  std::optional<Violation> violation_;
  std::vector<Motor> motors_;
  std::map<std::string, std::size_t> motor_by_name_;
  Promise promise_;
  TimeNs second_ns_ = -1;     // when a second daemon talked, the last time
  TimeNs none_waits_ns_ = 0;  // when nothing waited for its turn
  std::map<Key, Asked> asked_;
  std::deque<Key> finished_;  // of asked_, oldest first
  std::vector<std::optional<bushd::api::StateSnapshot>> states_;
  std::vector<bool> present_;     // by MCU
  std::vector<TimeNs> heard_ns_;  // by MCU: when it has heard somebody, the last time
  bool ready(std::size_t mcu) const;
  std::map<std::string, std::uint64_t> moves_by_result_;
  std::map<std::string, std::uint64_t> homings_by_result_;
  std::map<std::string, std::uint64_t> jogs_by_result_;
  std::map<std::string, std::uint64_t> programs_by_result_;
  std::uint64_t programs_judged_ = 0;
  // By name: what it may be, since one of them was known to be put. A daemon that was killed may
  // have put the newest or not.
  std::map<std::string, std::vector<McuProgram>> programs_put_;
  std::uint64_t approaches_ = 0;
  std::uint64_t times_paused_ = 0;
  std::uint64_t steps_commanded_ = 0;
  std::uint64_t ways_ = 0;
  std::uint64_t ways_apart_ = 0;
  std::int64_t most_ticks_apart_ = 0;
  double worst_off_way_ = 0;
};

}  // namespace bushfaults
