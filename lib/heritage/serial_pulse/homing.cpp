// A motor looks for its switch in the stages of HOME (firmware/core/homing.c):
//
//     fast        by the motor's table until the switch is active, and the ramp-down from there
//     back-off    slowly away from it until it is released
//     approach    slowly towards it until it is active again
//
// The slow stages are those of the source (docs/heritage.md): one step a byte, 0xF0, and after each
// a look at the switch. The next byte goes out when that one has left for sure, so home is exact to
// the step. A contact bounces: nothing is read for 5 ms behind a step, then it counts after three
// readings in a row, and no step is made before.
#include <algorithm>

#include "heritage/serial_pulse/master.h"

namespace bushd::serial_pulse {
namespace {

constexpr unsigned kReadings = 3;
constexpr std::int64_t kReadingUs = 1'000;
constexpr std::int64_t kBounceUs = 5'000;  // behind a step nothing is read for so long

}  // namespace

void SerialPulseMaster::home(link::McuIndex, const bushd_home& message) {
  requests_open_ = true;
  report_due_us_ = wake_us_ = 0;
  if (message.most_steps == 0) {
    if (homing_ && run_) ramp_down(run_->slow);
    if (homing_) homing_->stopped = true;
    return;
  }
  const int direction = message.direction;
  const bool ahead = status_ && forbidden(direction) && !at_home();
  const bool behind = status_ && forbidden(-direction);
  const bool stuck = behind && (ahead || at_home());
  if (run_ || homing_ || !status_ || stuck) {
    events_.push_back(link::RequestRefused{
        {0},
        BUSHD_MSG_HOME,
        stuck ? std::uint8_t{BUSHD_E_FORBIDDEN} : std::uint8_t{BUSHD_E_STATE}});
    return;
  }
  homing_ = Homing{.message = message};
  homing_->turned = ahead;
  homed_ = false;
  begin_fast(now_us_, ahead ? -direction : direction);
}

void SerialPulseMaster::begin_fast(std::int64_t now_us, int direction) {
  homing_->stage = BUSHD_HOMING_FAST;
  homing_->meets_limit = false;
  bushd_run run;
  bushd_run_start(&run, &table(), homing_->message.most_steps, direction,
                  homing_->message.shortest_delay);
  begin_run(now_us, {.run = run, .line = {}}, 0, false);
}

void SerialPulseMaster::begin_slow(std::int64_t now_us, bushd_homing stage, int direction) {
  homing_->stage = stage;
  homing_->readings = 0;
  const bushd_delay slow = homing_->message.slow_delay;
  slow_.cruise = static_cast<std::uint16_t>(std::min<bushd_delay>(slow, UINT16_MAX));
  slow_.time_unit_ns = BUSHD_HOME_UNIT_NS;
  slow_.accel.code = slow_.decel.code = &slow_.cruise;
  slow_.accel.count = slow_.decel.count = 1;
  bushd_run run;
  bushd_run_start(&run, &slow_, homing_->message.slow_steps, direction, slow);
  begin_run(now_us, {.run = run, .line = {}}, 0, false);
  run_->slow = true;
}

void SerialPulseMaster::follow_homing(std::int64_t now_us) {
  if (!homing_) return;
  if (faults_ != 0 || homing_->stopped) {
    if (run_ && run_->slow) ramp_down(true);
    if (!run_) end_homing(now_us, BUSHD_HOMING_STOPPED);
    return;
  }
  if (homing_->stage == BUSHD_HOMING_FAST || homing_->stage == BUSHD_HOMING_RAMP_DOWN) {
    follow_fast(now_us);
  } else {
    follow_slow(now_us);
  }
}

void SerialPulseMaster::follow_fast(std::int64_t now_us) {
  Homing& homing = *homing_;
  const int direction = homing.message.direction;
  const bool immediately = (setup_.mcus[0].inputs.limit_immediate & 1) != 0;
  if (homing.stage == BUSHD_HOMING_RAMP_DOWN) {
    if (!run_) begin_slow(now_us, BUSHD_HOMING_BACK_OFF, -direction);
  } else if (at_home()) {
    if (run_ && !homing.meets_limit) ramp_down(false);
    homing.stage = BUSHD_HOMING_RAMP_DOWN;
  } else if (run_) {
    if (homing.meets_limit || !forbidden(run_->direction)) return;
    ramp_down(immediately);
    homing.meets_limit = true;
  } else if (!homing.meets_limit || homing.turned) {
    end_homing(now_us, BUSHD_HOMING_NOT_FOUND);
  } else {
    // The switch is on the limit's other side, once.
    homing.turned = true;
    begin_fast(now_us, -direction);
  }
}

bool SerialPulseMaster::is_sure(std::int64_t now_us, bool as_wanted) {
  Homing& homing = *homing_;
  if (!as_wanted) {
    homing.readings = 0;
    return false;
  }
  if (homing.readings == 0 || status_us_ >= homing.read_us + kReadingUs) {
    homing.read_us = status_us_;
    ++homing.readings;
  }
  if (homing.readings >= kReadings) return true;
  ask_at(std::max(now_us, homing.read_us + kReadingUs));
  return false;
}

// The last step has been made for sure, and the lines have been read since, when they were quiet.
bool SerialPulseMaster::looked(std::int64_t now_us) {
  if (!drained(now_us)) {
    wait_until_drained(now_us);
    return false;
  }
  const std::int64_t quiet_us = us_of(line_free_ns_) + kBounceUs;
  if (status_us_ >= quiet_us) return true;
  ask_at(std::max(quiet_us, now_us));
  return false;
}

void SerialPulseMaster::follow_slow(std::int64_t now_us) {
  if (!run_) return end_homing(now_us, BUSHD_HOMING_STOPPED);
  if (!looked(now_us)) return;
  const bool approaches = homing_->stage == BUSHD_HOMING_APPROACH;
  const int direction = homing_->message.direction;
  if (is_sure(now_us, at_home() == approaches)) {
    end_run(now_us);
    if (!approaches) return begin_slow(now_us, BUSHD_HOMING_APPROACH, direction);
    position_ = homing_->message.position_steps;
    homed_ = true;
    return end_homing(now_us, BUSHD_HOMING_DONE);
  }
  if (homing_->readings > 0) return;
  const bool limit = forbidden(run_->direction);
  if (!limit && run_->ahead.left() > 0) return;
  end_run(now_us);
  end_homing(now_us, limit        ? BUSHD_HOMING_LIMIT
                     : approaches ? BUSHD_HOMING_LOST
                                  : BUSHD_HOMING_STUCK);
}

void SerialPulseMaster::end_homing(std::int64_t now_us, bushd_homing how) {
  last_homing_ = how;
  homing_.reset();
  report_due_us_ = now_us;
}

}  // namespace bushd::serial_pulse
