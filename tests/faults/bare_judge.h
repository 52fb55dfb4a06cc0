// Whether what the daemon says of controllers without firmware is what their motors did. It knows
// the edges of STEP and DIR, requests, replies and states, and the faults that were injected.
//
// What must hold:
//
//   - A position that is called known or restored is, at rest, where the motor stands now, to the
//     step, counted from where somebody said that it stood, or from its home switch. In motion it
//     is a position that the motor had within the last 1.5 s: never one that lies ahead. Where the
//     hardware of a port pauses without telling, what it holds is the tolerance.
//   - After a lost port the reason of an uncertain position tells a number of steps; the motor
//     stands no farther than that from what is shown.
//   - Of a run of N steps, from rest to rest, the interval before step j is at least
//     max(A(j-1), D(N-j)). Where another plan has ended it, or a limit, its ramp may have left out
//     steps of equal delay: the running one counts as the last of them. Then D counts each delay
//     once. Where something has cut it off there is no D.
//   - No step comes that nobody has asked for: without a request under way, or a key that was
//     pressed within the keep-alive time, and the time that a ramp takes.
//   - Each accepted request has one result; `reached` at its target, to the step.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "api/snapshot.h"
#include "config/config.h"
#include "recent.h"
#include "sim/edge.h"

namespace bushfaults {

class BareJudge final : public bushd::sim::EdgeSink {
 public:
  using TimeNs = bushd::sim::TimeNs;
  using Violated = std::function<void(TimeNs now_ns, const std::string& what)>;

  // Judges the motors of `config` from `first_motor` on. `keeps`: positions outlive the daemon.
  BareJudge(const bushd::config::Config& config, std::size_t first_motor, bool keeps,
            Recent& recent, Violated violated);

  // Its home switch, and the position that is set there.
  void has_switch(std::size_t motor, std::int64_t at_steps, std::int64_t set_to);

  // What the motors do. Edges name the MCU by its index in the configuration.
  void edge(const bushd::sim::Edge& edge) override;
  void settled(TimeNs) override {}
  // Time has come to now_ns: runs that are over are judged.
  void advance_to(TimeNs now_ns);

  // What was injected. Motors by their index in the configuration.
  void excused_until(std::size_t motor, TimeNs until_ns);  // it may move, or stand, until then
  void cut_off(std::size_t motor);                         // it may stop dead
  void port_lost(std::size_t motor);
  // The daemon does nothing until then: what it says next is of now.
  void paused(TimeNs now_ns, TimeNs until_ns);
  void change(std::size_t motor);  // it may ramp down
  // So many steps may be on their way that the daemon cannot see.
  void unseen(std::size_t motor, std::uint32_t steps) { motors_[motor - first_].unseen = steps; }
  // What its line was made to do must never be.
  void line_violated(TimeNs now_ns, std::size_t motor) {
    violated(now_ns, motors_[motor - first_], "has a line that changes amid bytes");
  }
  // Its keys let it move until then.
  void keys_until(std::size_t motor, TimeNs until_ns);

  void daemon_started(TimeNs now_ns);
  void daemon_gone(TimeNs now_ns);
  void asked(TimeNs now_ns, std::int64_t number, const bushd::api::Request& request);
  void replied(TimeNs now_ns, std::int64_t number, const bushd::api::Reply& reply);
  // By somebody else.
  void asked_by_others(TimeNs now_ns, const bushd::api::Request& request);
  void state(TimeNs now_ns, const bushd::api::StateSnapshot& state);

  bool any_open() const { return !open_.empty(); }
  std::string open_text() const;
  // At rest, as far as can be seen from its steps and the last state.
  bool rests(std::size_t motor) const;
  // The state of its MCU, as said last.
  bushd::api::McuState seen(std::size_t motor) const { return motors_[motor - first_].seen; }
  bool is_trusted(std::size_t motor) const { return motors_[motor - first_].trusted; }
  std::int64_t position(std::size_t motor) const { return motors_[motor - first_].position; }

  std::uint64_t steps() const { return steps_; }
  std::uint64_t runs() const { return runs_; }
  const std::map<std::string, std::uint64_t>& results() const { return results_; }
  std::uint64_t states_checked() const { return states_checked_; }

 private:
  struct At {
    TimeNs time_ns;
    std::int64_t position;
  };
  struct Motor {
    std::string name;
    std::size_t mcu;
    std::size_t output;
    std::vector<TimeNs> accel_ns;  // A(0), A(1), ..., the last one for all further
    std::vector<TimeNs> decel_ns;
    std::vector<TimeNs> levels_ns{};  // of these, each once
    TimeNs slow_ns = 0;               // of homing; 0: it cannot
    TimeNs rest_ns = 0;               // silent for longer, it rests
    TimeNs ramp_ns = 0;               // until it does, at most
    std::int64_t position = 0;
    bool positive = false;
    std::deque<At> path{};
    std::vector<TimeNs> run{};
    bool cut = false;
    // Its daemon had gone before a request's first step was made: what was under way is cut off.
    std::optional<TimeNs> gone_ns{};
    bool changed = false;
    bool homes = false;
    TimeNs excused_ns = 0;
    TimeNs keys_ns = -1;
    TimeNs caused_ns = 0;                // by a request, if none is open
    std::uint64_t touched_by = 0;        // the latest request for it, counting all
    std::optional<TimeNs> stopped_ns{};  // by others
    std::uint32_t unseen = 0;
    int open = 0;
    // What positions that are told are less than `position`.
    std::optional<std::int64_t> offset{};
    std::vector<std::int64_t> perhaps{};
    std::optional<std::int64_t> home_offset{};
    bool perhaps_homed = false;
    bushd::api::McuState seen = bushd::api::McuState::kOffline;
    bool lost = false;  // its port, and how many steps that may be is not checked yet
    bool trusted = false;
    bool resting = false;
  };
  struct Open {
    std::string text;
    bool accepted = false;
    bool is_motion = false;
    TimeNs since_ns = 0;
    std::uint64_t order = 0;  // among all requests: many come at the same time
    std::vector<std::size_t> motors{};
    std::vector<std::optional<std::int64_t>> target{};
    std::optional<std::int64_t> set_offset{};
    bool homes = false;
  };

  Motor* find(const std::string& name);
  void step(TimeNs time_ns, Motor& motor);
  void judge_run(Motor& motor);
  void begin(TimeNs now_ns, Open& open, const std::string& name,
             std::optional<std::int64_t> target);
  void completed(TimeNs now_ns, Open& open, const bushd::api::Completed& result);
  void ended(TimeNs now_ns, Open& open, std::size_t i, const bushd::api::MotorResult& result);
  void close(TimeNs now_ns, Open& open);
  void check(TimeNs now_ns, Motor& motor, const bushd::api::MotorState& claim, bool online);
  // A report behind a state is not older.
  TimeNs oldest_ns(TimeNs now_ns) const;
  void check_uncertain(TimeNs now_ns, const Motor& motor, const bushd::api::MotorState& claim);
  bool was_there(TimeNs now_ns, const Motor& motor, std::int64_t at) const;
  void violated(TimeNs now_ns, const Motor& motor, const std::string& what) {
    violated_(now_ns, motor.name + " " + what);
  }

  const std::size_t first_;
  const bool keeps_;
  Recent& recent_;
  const Violated violated_;
  std::vector<Motor> motors_;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> by_output_;
  std::map<std::int64_t, Open> open_;
  std::uint64_t requests_ = 0;
  TimeNs paused_ns_ = 0;  // the last time
  TimeNs paused_until_ns_ = 0;
  std::uint64_t steps_ = 0;
  std::uint64_t runs_ = 0;
  std::uint64_t states_checked_ = 0;
  std::map<std::string, std::uint64_t> results_;
};

}  // namespace bushfaults
