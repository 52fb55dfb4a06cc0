// Whether a motor's steps, seen from outside, keep to its table: no jump in speed, neither up nor
// down, whoever made the steps (streamed ticks, a stop, an MCU's own ramp-down).
//
// Let tau_j be the exact time of step j by the table and t_j when its pulse came. Within
// tolerances derived below, t_j = tau_j + e with |e| <= E. From rest, the exact delay before step j
// is one of the table's, and after A(k) no shorter one than A(k+1) can follow. So two bounds are
// carried from step to step:
//
//     k    <=  k + 1; and if the pulses lie m apart, the exact delay was >= m - 2E, which may say
//              that k is smaller
//     tau  >=  max( tau of the step before + A(k), t - E )
//
// and a pulse is a violation if it comes before this bound by more than E. Errors do not add up:
// the bound on tau is one of absolute time, so being a little too fast for long is found too.
// Speeds can only fall as a table allows: when a motor has come to rest, its last n steps must have
// taken at least D(n-1) + ... + D(0), less 2E, for every n. A gap within a motion, or a motion that
// goes on after a gap, breaks the first rule: after a long delay only the beginning of the table is
// allowed.
//
// On a line a motor follows the run of another one: it may be slower than its table for a while,
// and go on as its table does from rest in as many steps. There k only rises: no delay is shorter
// than the table's after as many steps from rest.
//
// On a path, which is made like a line, it may turn round without a rest, with speeds v1 and v2 of
// which v1^2 + v2^2 <= F^2, F = 1 / A(0): by its plan it ramps down to the turn as to a rest, and
// speeds up from it as from one. The turn is half a step beyond the last step, and half a step
// before the first one back, by the shares r1, r2 of the run, whose own half steps lie between:
//
//     apart = (1 - r1) / 2 v1 + (1 + r2) / 2 v2  >=  1 / 2 F = A(0) / 2 ,  as r1 <= 1, v2 <= F.
//
// Tolerances. T is the tick, S its slots; ticks are emitted up to 1/64 (sync) and 50 ppm (crystal)
// faster than real time, so every delay counts 1/63 less. Fine format (docs/performance.md):
//
//     E = min( T, (dv T/4 + 1/256) / v ) + T/S
//
// with dv the greatest change of speed in a tick that contains the step and v the slowest speed in
// it, both by the table. Coarse: steps are spaced evenly in their tick, so E = T, and for delays d
// shorter than the tick E = d. In the last tick steps may be late by up to T (they spread over the
// tick, the movement does not); late means slower, and matters only for the start after it.
//
// E must be taken for the exact delay d, which is unknown; since E <= 3d/8 in the fine format,
// d <= 4m, and E rises with d: that of 4m is enough. (In the coarse format, with c steps in a tick,
// m >= T/2c and d <= 2T/c.)
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/message.h"
#include "engine/table.h"
#include "sim/edge.h"

namespace bushd::sim {

// What a table allows, with its tolerances; shared by all motors that run it.
class PaceRules {
 public:
  PaceRules(const bushd_table& table, std::uint32_t tick_ns, std::uint16_t slots,
            bushd_format format);

  // The motor may move by slower tables as well, which take longer to ramp down.
  void allow_slower(const PaceRules& slower) {
    for (TimeNs& ns : ramp_down_ns_) ns = std::max(ns, slower.ramp_down_ns_.back());
  }

  TimeNs tick_ns() const { return tick_ns_; }
  std::size_t last() const { return delay_ns_.size() - 1; }              // the index of cruise
  TimeNs delay_ns(std::size_t k) const { return delay_ns_[k]; }          // A(k), 1/63 shorter
  TimeNs tolerance_ns(std::size_t k) const { return tolerance_ns_[k]; }  // for A(k) and shorter
  std::size_t stop_steps() const { return stop_ns_.size() - 1; }
  TimeNs stop_ns(std::size_t n) const { return stop_ns_[n]; }  // the least time of the last n
  // The longest ramp-down, tolerances included, of a motor whose exact delay is at least A(k): it
  // completes the running step, of delay x, and makes the fewest steps n with D(n) <= x.
  TimeNs ramp_down_ns(std::size_t k) const { return ramp_down_ns_[k]; }
  // The longest delay that an MCU can be told. On a line the running step may take as long.
  TimeNs longest_told_ns() const { return longest_told_ns_; }
  // Silent for longer, the motor is surely at rest.
  TimeNs rest_ns() const { return rest_ns_; }

 private:
  TimeNs tick_ns_;
  std::vector<TimeNs> delay_ns_;
  std::vector<TimeNs> tolerance_ns_;
  std::vector<TimeNs> stop_ns_;
  std::vector<TimeNs> ramp_down_ns_;
  TimeNs rest_ns_;
  TimeNs longest_told_ns_;
};

enum class Jump {
  kNone,
  kTooFast,     // a step earlier than the table allows after those before
  kTurned,      // the direction changed without a rest
  kStoppedDead  // at rest without a ramp-down
};

class Pace {
 public:
  explicit Pace(const PaceRules& rules) : rules_(&rules) {}

  // A step at t_ns, not before the last one. O(1) amortised.
  Jump step(TimeNs t_ns, bool positive);
  // Its next motion, from rest, is one of a line, until it is said to rest. Without `rests`
  // it may still move, along the line, for as long as its MCU goes on without a master, by what is
  // queued or by a run of its own.
  // A line before that was forgotten is over where it has made no step for so long as at rest.
  void begin_on_line(TimeNs now_ns) {
    if (excused_ && count_ != 0 && now_ns - last_ns() >= rules_->rest_ns()) count_ = 0;
    on_line_ = told_ = true;
    line_until_ns_ = kNever;
  }
  Jump rest_on_line(TimeNs now_ns, bool rests) {
    if (!on_line_) return Jump::kNone;
    if (!rests) {
      line_until_ns_ = now_ns + kMostSilenceNs + rules_->ramp_down_ns(rules_->last()) +
                       rules_->longest_told_ns();
      return Jump::kNone;
    }
    leave_line(false);
    told_ = false;
    return count_ != 0 ? come_to_rest() : Jump::kNone;
  }
  // Another motion begins: whatever the line was, it is over.
  void forget_line() {
    if (on_line_) leave_line(true);
    told_ = false;
  }

  // No step since the last one until now.
  Jump silent(TimeNs now_ns) {
    end_line_if_over(now_ns);
    if (on_line_ || count_ == 0 || now_ns - last_ns() < rules_->rest_ns()) return Jump::kNone;
    return come_to_rest();
  }
  // The motor was cut off (a reset): what came before says nothing about what follows.
  void cut() { count_ = 0; }
  // As cut(). Returns whether it was faster than it could have stopped.
  bool cut_off() { return count_ != 0 && come_to_rest() == Jump::kStoppedDead; }

  bool moving() const { return count_ != 0; }
  // If it ramps down from now on, it rests after this time. At rest: it may have begun, and then
  // completes its first step.
  TimeNs ramp_down_ns() const {
    const std::size_t k = count_ == 0 ? 0 : std::min(k_ + 1, rules_->last());
    return rules_->ramp_down_ns(k) + (told_ ? rules_->longest_told_ns() : 0);
  }
  TimeNs last_ns() const { return time_ns_[newest_]; }
  // A motion begins with the next step, though that may come sooner after the one before than a
  // motor surely rests.
  void begin() { begins_ = true; }
  // The first step since the last rest, or of the motion that began since.
  TimeNs first_ns() const { return first_ns_; }
  // For a message, after a jump: how much too early (kTooFast, kTurned).
  TimeNs too_early_ns() const { return too_early_ns_; }

 private:
  static constexpr std::size_t kHistory = 64;  // a power of two
  // A second from the time that the last SYNC has told, which may be that of the one before.
  static constexpr TimeNs kMostSilenceNs = 2'000'000'000;
  static constexpr TimeNs kNever = INT64_MAX;

  void leave_line(bool excused) {
    on_line_ = false;
    excused_ = excused;
    line_until_ns_ = kNever;
  }

  void end_line_if_over(TimeNs now_ns) {
    if (on_line_ && now_ns > line_until_ns_) leave_line(true);
  }

  Jump judged(TimeNs t_ns, bool positive);
  void start(TimeNs t_ns, bool positive);
  void remember(TimeNs t_ns);
  Jump come_to_rest();

  const PaceRules* rules_;
  std::array<TimeNs, kHistory> time_ns_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 0;  // steps since rest, at most kHistory
  bool positive_ = false;
  bool on_line_ = false;
  // By a line, also by one that was lost: its running step may be as slow as any that can be told.
  bool told_ = false;
  TimeNs line_until_ns_ = kNever;
  bool excused_ = false;    // from ramping down by its table, until it starts again
  std::size_t k_ = 0;       // the last exact delay was at least A(k)
  std::size_t cursor_ = 0;  // where the tolerance was found last
  bool begins_ = false;     // with the next step
  TimeNs first_ns_ = 0;
  TimeNs exact_ns_ = 0;  // the last step's exact time is not before this
  TimeNs too_early_ns_ = 0;
};

}  // namespace bushd::sim
