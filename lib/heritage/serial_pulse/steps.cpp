#include "heritage/serial_pulse/steps.h"

#include <algorithm>
#include <utility>

#include "engine/line.h"
#include "engine/run_plan.h"

namespace bushd::serial_pulse {
namespace {

__extension__ using Wide = unsigned __int128;

bushd_line place_of(const link::MotorPlan::Line& line, std::uint32_t run_steps) {
  bushd_line place;
  bushd_line_start(&place, line.increment, line.longest);
  bushd_line_go_to(&place, line.from + run_steps);
  return place;
}

}  // namespace

Steps::Steps(const link::MotorPlan& plan) : run_(plan.run), line_(plan.line) {
  if (line_) made_ = place_of(*line_, 0).made;
}

void Steps::be(const bushd_run& run) {
  if (line_) run_ns_ = time_ns(run.steps_done);
  run_ = run;
}

// One that is before `run` is still to be passed: the motor's next step may lie behind both.
void Steps::become(const bushd_run& run) {
  if (!line_) then_.clear();
  while (!then_.empty() && then_.back().steps_done >= run.steps_done) then_.pop_back();
  then_.push_back(run);
}

void Steps::pass(std::uint32_t run_steps) {
  while (!then_.empty() && then_.front().steps_done < run_steps) {
    be(then_.front());
    then_.pop_front();
  }
}

void Steps::ramp_down(const Ticks& ticks) {
  if (!line_) {
    then_.clear();
    return bushd_run_ramp_down(&run_);
  }
  const bushd_run from = ticks.after(run_step_);
  pass(from.steps_done);
  then_.clear();
  be(from);
  bushd_run_ramp_down_once(&run_);
}

std::uint32_t Steps::run_end() const {
  const bushd_run& last = then_.empty() ? run_ : then_.back();
  return last.steps_done + bushd_run_steps_left(&last);
}

std::uint32_t Steps::left() const {
  if (ended_) return 0;
  if (!line_) return run_end() - run_.steps_done;
  return place_of(*line_, run_end()).made - made_;
}

// Precondition: run_ has made no more.
std::uint64_t Steps::time_ns(std::uint32_t run_steps) const {
  const std::uint32_t left = bushd_run_steps_left(&run_);
  const std::uint64_t all = bushd_run_units_of_last(&run_, left);
  const std::uint64_t after = bushd_run_units_of_last(&run_, left - (run_steps - run_.steps_done));
  return run_ns_ + (all - after) * run_.table->time_unit_ns;
}

std::uint64_t Steps::take_ns() {
  if (ended_ || left() == 0) return 0;
  if (line_) return take_on_line();
  if (!then_.empty() && run_.steps_done >= then_.front().steps_done) {
    run_ = then_.front();
    then_.pop_front();
  }
  return std::uint64_t{bushd_run_take_step(&run_)} * run_.table->time_unit_ns;
}

std::uint64_t Steps::take_on_line() {
  bushd_line place = place_of(*line_, 0);
  const std::uint32_t run_step = bushd_line_run_step(&place, made_ + 1) - line_->from;
  pass(run_step);
  place = place_of(*line_, run_step - 1);
  // What is missing to the next step of the motor is missing / 2N of this step of the run.
  const std::uint64_t twice_longest = std::uint64_t{line_->longest} * 2;
  const std::uint64_t missing =
      twice_longest - std::uint64_t{place.value} * 2 - ((line_->longest - line_->increment) & 1u);
  const std::uint64_t begin_ns = time_ns(run_step - 1);
  const std::uint64_t delay_ns = time_ns(run_step) - begin_ns;
  const Wide twice_increment = Wide{line_->increment} * 2;
  const Wide part_ns = (Wide{delay_ns} * missing + twice_increment - 1) / twice_increment;
  const std::uint64_t at_ns = begin_ns + static_cast<std::uint64_t>(part_ns);
  ++made_;
  run_step_ = run_step;
  return at_ns - std::exchange(last_ns_, at_ns);
}

std::uint32_t Ticks::made() const {
  if (!plan_.line) return plan_.run.steps_done;
  const bushd_line place = place_of(*plan_.line, plan_.run.steps_done);
  const std::uint32_t end = plan_.run.steps_done + bushd_run_steps_left(&plan_.run);
  const auto at = static_cast<std::uint32_t>(bushd_line_position(&place, plan_.run.fraction) / 256);
  return std::min(at, place_of(*plan_.line, end).made) - place_of(*plan_.line, 0).made;
}

void Ticks::pass(std::uint32_t tick_ns) {
  std::int16_t moved = 0;
  bushd_run_expand_fine(&plan_.run, tick_ns, 1, &moved, 1);
}

bushd_run Ticks::after(std::uint32_t run_steps) const {
  bushd_run run = plan_.run;
  while (run.steps_done < run_steps && bushd_run_take_step(&run) != 0) {
  }
  return run;
}

}  // namespace bushd::serial_pulse
