#include "heritage/serial_pulse/master.h"

#include <functional>
#include <utility>

namespace bushd::serial_pulse {
namespace {

using link::McuIndex;
using link::Tick;

constexpr McuIndex kMcu{0};
constexpr std::int64_t kMovingAskUs = 2'000;
constexpr std::int64_t kRestingAskUs = 20'000;
constexpr std::int64_t kReportUs = 20'000;
constexpr std::int64_t kRestingReportUs = 100'000;
constexpr std::uint32_t kLowestOnLine = 1'000;
// What a change of rate takes beside the time in which the line is drained for sure.
constexpr std::int64_t kChangeUs = 2'000;

// A delay of the run between two steps of the motor; none is told to be longer than a day.
std::uint64_t motor_ns(const link::MotorPlan& plan, bushd_delay delay) {
  __extension__ using Wide = unsigned __int128;
  constexpr Wide kLongestNs = Wide{86'400} * 1'000'000'000;
  Wide ns = Wide{delay} * plan.run.table->time_unit_ns;
  if (plan.line && plan.line->increment != 0) ns = ns * plan.line->longest / plan.line->increment;
  return static_cast<std::uint64_t>(std::min(ns, kLongestNs));
}

}  // namespace

SerialPulseMaster::SerialPulseMaster(link::BusSetup setup, link::TickSource& source,
                                     std::uint64_t unique_id)
    : setup_(std::move(setup)), source_(source) {
  bushd_identity& identity = view_.identity;
  identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  identity.motors = 1;
  identity.boot_number = setup_.master;  // the counter is the daemon's
  identity.capabilities = BUSHD_CAN_FINE | BUSHD_CAN_COARSE | BUSHD_CAN_TABLE_RUN | BUSHD_CAN_HOME |
                          BUSHD_CAN_SLOW_RUNS;
  for (std::size_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) {
    identity.unique_id[i] = static_cast<std::uint8_t>(unique_id >> (56 - 8 * i));
  }
}

void SerialPulseMaster::port_opened(std::int64_t now_us) {
  open_ = true;
  waits_ = fresh_ = false;
  order_.reset();
  status_.reset();
  asked_baud_ = 0;
  made_.clear();
  line_free_ns_ = now_us * 1000;
  ask_us_ = now_us;
  wake_us_ = now_us;
}

void SerialPulseMaster::port_lost(std::int64_t now_us, const std::string& cause) {
  const bool was_online = view_.phase == link::McuPhase::kOnline;
  if (status_) count_gone(now_us);
  const std::uint32_t unsure = unsure_steps();
  if (run_) {
    // As far as is known they have left.
    while (!sent_.empty() && sent_.front().gone_ns <= now_us * 1000) {
      run_->gone += sent_.front().steps;
      sent_.pop_front();
    }
    if (run_->planned) {
      base_tick_ = run_->tick;
      base_us_ = now_us;
    }
    position_ = run_->from_steps + run_->direction * std::int64_t{run_->gone};
    run_.reset();
  }
  if (homing_) end_homing(now_us, BUSHD_HOMING_STOPPED);
  sent_.clear();
  recent_.clear();
  burst_us_.reset();
  open_ = false;
  waits_ = fresh_ = false;
  order_.reset();
  view_.phase = link::McuPhase::kOffline;
  view_.detail = cause;
  if (was_online) events_.push_back(link::McuOffline{kMcu});
  if (unsure == 0) return;
  view_.uncertain_reason =
      cause + " while " + std::to_string(unsure) + " steps were under way: as many may be missing";
  events_.push_back(link::PositionUncertain{kMcu, 0});
}

std::vector<link::Event> SerialPulseMaster::take_events() {
  return std::exchange(events_, {});
}

std::span<const std::uint8_t> SerialPulseMaster::step(std::int64_t now_us) {
  fresh_ = false;
  now_us_ = now_us;
  if (!open_ || waits_) return {};
  wake_us_ = INT64_MAX;
  link::PulseOrder order;
  // What is known is of then, until the port has answered.
  if (status_ && now_us > status_us_ + kStillUs) {
    ask_us_ = now_us;
  } else if (status_) {
    count_gone(now_us);
    measure_line(now_us);
    watch_limits(now_us);
    follow_homing(now_us);
    if (run_) {
      if (run_->planned) advance_ticks(now_us, false);
      if (run_->ahead.left() == 0 && drained(now_us) && line_is_over(now_us)) {
        end_run(now_us);
        follow_homing(now_us);
      }
    }
    if (run_) write(now_us, order);
  }
  if (order.positive || order.baud || !order.bytes.empty() || now_us >= ask_us_) {
    order_ = std::move(order);
    waits_ = fresh_ = true;
    ask_us_ = now_us + (run_ || homing_ ? kMovingAskUs : kRestingAskUs);
  }
  if (view_.phase != link::McuPhase::kOnline) {
    wake_at(ask_us_);
    return {};
  }
  if (now_us >= report_due_us_) report(now_us);
  wake_at(std::min(ask_us_, report_due_us_));
  return {};
}

std::int64_t SerialPulseMaster::next_wake_us() const {
  return open_ && !waits_ ? wake_us_ : INT64_MAX;
}

void SerialPulseMaster::pulse_status(std::int64_t now_us, const link::PulseStatus& status) {
  if (!open_) return;
  waits_ = false;
  now_us_ = now_us;
  if (!status_ || status.positive != status_->positive) direction_us_ = now_us;
  if (!status_ || status.lines != status_->lines) report_due_us_ = now_us;
  // As much as is ever under way may be another program's.
  if (!status_ || (view_.phase != link::McuPhase::kOnline && status_->queued > 0)) {
    const std::int64_t one_ns =
        status.baud > 0 ? static_cast<std::int64_t>(byte_ns(status.baud)) : 0;
    passed_free_ns_ = now_us * 1000 + std::max(kMostAheadUs * 1000, kSpareUs * 1000 + one_ns);
  }
  if (order_ && order_->baud) {
    made_[*order_->baud] = status.baud;
    planner_.learn(*order_->baud, status.baud);
  }
  order_.reset();
  status_ = status;
  status_us_ = now_us;
  follow_queue();
  follow_passed_on();
  for (const int direction : {-1, 1}) {
    if (at_limit(direction)) limit_us_[direction > 0] = now_us;
  }
  wake_us_ = now_us;
  // What another program has left in the driver moves the motor still.
  if (view_.phase != link::McuPhase::kOnline && drained(now_us)) identify();
  measure_pauses();
}

void SerialPulseMaster::identify() {
  view_.phase = link::McuPhase::kOnline;
  view_.detail.clear();
  view_.identified = true;
  report(status_us_);
  events_.insert(events_.begin(), link::McuOnline{kMcu});
}

// --- Time

std::int64_t SerialPulseMaster::us_per_ticks(Tick ticks) const {
  return ticks * setup_.tick_ns / 1000;
}

Tick SerialPulseMaster::clock(std::int64_t now_us) const {
  return base_tick_ + (now_us - base_us_) * 1000 / setup_.tick_ns;
}

Tick SerialPulseMaster::tick_at(std::int64_t now_us) const {
  return run_ && run_->planned ? run_->tick : clock(now_us);
}

Tick SerialPulseMaster::earliest_start(std::int64_t now_us, McuIndex, std::uint8_t) const {
  return std::max(clock(now_us), view_.tick) + 2;
}

// The first tick at whose beginning the plan has made all that has been written.
Tick SerialPulseMaster::earliest_replace(std::int64_t now_us,
                                         std::span<const link::ToReplace>) const {
  if (!run_ || !run_->planned) return clock(now_us) + 2;
  const Run& run = *run_;
  if (run.written == 0) return run.tick;
  Ticks by_ticks = run.by_ticks;
  Tick tick = run.tick;
  for (;; ++tick) {
    if (run.change && tick == run.change->at) by_ticks = run.change->plan;
    if (by_ticks.made() >= run.written || by_ticks.over()) return tick;
    by_ticks.pass(setup_.tick_ns);
  }
}

Tick SerialPulseMaster::earliest_retarget(std::int64_t now_us,
                                          std::span<const link::ToReplace> together,
                                          Tick start) const {
  return std::max(earliest_replace(now_us, together), start);
}

// The report is of the last tick at whose beginning the plan had made no more steps than have left.
// The last tick of a run is told when all has left for sure.
void SerialPulseMaster::advance_ticks(std::int64_t now_us, bool to_the_end) {
  Run& run = *run_;
  if (run.tick < run.start) run.tick = to_the_end ? run.start : std::min(run.start, clock(now_us));
  if (run.tick < run.start) return;
  const Tick now = run.pace ? line_clock(now_us) : clock(now_us);
  for (;;) {
    if (run.change && run.tick == run.change->at) {
      run.by_ticks = std::exchange(run.change, std::nullopt)->plan;
    }
    if (run.by_ticks.over()) return;
    Ticks next = run.by_ticks;
    next.pass(setup_.tick_ns);
    const bool early = next.made() > run.gone || run.tick >= now || next.over();
    if (early && !to_the_end) return;
    run.by_ticks = next;
    ++run.tick;
  }
}

// --- Inputs

bool SerialPulseMaster::reads(std::uint8_t number) const {
  const unsigned active = status_->lines ^ setup_.mcus[0].inputs.inverted;
  return (active >> number & 1) != 0;
}

bushd_motor_inputs SerialPulseMaster::numbers() const {
  const auto& named = setup_.mcus[0].motor_inputs;
  return named.empty() ? bushd_motor_inputs{} : named.front();
}

bool SerialPulseMaster::at_limit(int direction) const {
  const bushd_set_inputs& inputs = setup_.mcus[0].inputs;
  const bool has = ((direction > 0 ? inputs.limit_positive : inputs.limit_negative) & 1) != 0;
  return has && reads(direction > 0 ? numbers().positive : numbers().negative);
}

// For a report that tells where a run was ended, too, however its switch is by then.
bool SerialPulseMaster::forbidden(int direction) const {
  return (run_ && run_->limited && run_->direction == direction) ||
         now_us_ < limit_us_[direction > 0] + kReleaseUs;
}

void SerialPulseMaster::watch_limits(std::int64_t now_us) {
  if (!run_ || homing_ || !forbidden(run_->direction)) return;
  const bool immediately = (setup_.mcus[0].inputs.limit_immediate & 1) != 0;
  if (!run_->planned && !immediately) return;  // it ramps down already
  run_->limited = true;
  leave_plan(now_us, immediately);
}

// --- Runs

const bushd_table& SerialPulseMaster::table() const {
  const link::McuSetup& mcu = setup_.mcus[0];
  return *mcu.tables[mcu.table_of_motor[0].value_or(0)].table;
}

void SerialPulseMaster::begin(McuIndex, std::uint8_t, Tick start) {
  const auto plan = source_.plan_at(kMcu, 0, start);
  if (!plan || run_ || !status_) {
    events_.push_back(link::StartMissed{kMcu, 0});
    return;
  }
  begin_run(base_us_, {.run = *plan, .line = {}}, start, true);
}

void SerialPulseMaster::begin_run(std::int64_t now_us, const link::MotorPlan& plan, Tick start,
                                  bool planned) {
  const bushd_run& run = plan.run;
  // The delay before the first step of a line counts from when all are ready.
  const std::int64_t first_us =
      plan.line ? 0
                : us_of(static_cast<std::int64_t>(bushd_run_delay(&run) * run.table->time_unit_ns));
  const std::int64_t start_us = planned ? base_us_ + us_per_ticks(start - base_tick_) + 1 : now_us;
  run_.emplace(Run{.ahead = Steps(plan),
                   .by_ticks = Ticks(plan),
                   .start = start,
                   .tick = view_.tick,
                   .planned = planned,
                   .direction = run.direction < 0 ? -1 : 1,
                   .from_steps = position_,
                   .not_before_us = start_us + first_us,
                   .on_line = plan.line.has_value()});
  if (plan.line) run_->direction = plan.line->direction;
  plan_rates(plan);
  wake_us_ = 0;
}

void SerialPulseMaster::plan_rates(const link::MotorPlan& plan) {
  const bushd_run& run = plan.run;
  const auto ns_of = [&](bushd_delay delay) { return motor_ns(plan, delay); };
  const std::uint64_t longest = ns_of(
      std::max<bushd_delay>({run.table->accel.code[0], run.table->decel.code[0], run.cruise}));
  Rates driver{.any = status_->any_rate, .base = status_->base};
  // On a line slower steps wait for their time one by one, where that does not take longer.
  if (plan.line && status_->empty) driver.lowest = kLowestOnLine;
  std::vector<Rate> rates = rates_for(driver, ns_of(run.table->cruise), longest);
  // The shortest delay of the run may be another speed than one of the table.
  const std::vector<Rate> of_shortest_delay = rates_for(driver, ns_of(run.cruise), longest);
  rates.insert(rates.end(), of_shortest_delay.begin(), of_shortest_delay.end());
  std::ranges::sort(rates, std::greater<>(), &Rate::ask);
  const auto same = [](const Rate& one, const Rate& other) { return one.ask == other.ask; };
  rates.erase(std::unique(rates.begin(), rates.end(), same), rates.end());
  const std::int64_t change_us = kChangeUs + (status_->empty ? 0 : kUnseenUs);
  planner_ = Planner(std::move(rates), static_cast<std::uint64_t>(change_us) * 1000);
  for (const auto& [ask, made] : made_) planner_.learn(ask, made);
}

void SerialPulseMaster::replace(McuIndex, std::uint16_t, Tick first) {
  if (!run_ || !run_->planned) return;
  Run& run = *run_;
  const auto plan = plan_from(first);
  if (!plan) return;
  const Ticks by_ticks(*plan);
  if (by_ticks.made() < run.written) {
    events_.push_back(link::ReplacementFailed{kMcu, 1});
    return;
  }
  plan_rates(*plan);
  wake_us_ = 0;
  if (first > run.start) {
    run.change = Run::Change{.at = first, .plan = by_ticks};
    run.ahead.become(plan->run);
    return keep_delay_of(run.ahead);
  }
  run.ahead = Steps(*plan);
  run.by_ticks = by_ticks;
  if (!plan->line) run.direction = plan->run.direction < 0 ? -1 : 1;
}

// From now on ticks go by the clock, for the plan does not tell any more where the motor is.
void SerialPulseMaster::leave_plan(std::int64_t now_us, bool immediately) {
  if (run_->planned) {
    base_tick_ = run_->tick;
    base_us_ = now_us;
    run_->planned = false;
    run_->pace.reset();
  }
  ramp_down(immediately);
  report_due_us_ = now_us;
}

void SerialPulseMaster::ramp_down(bool immediately) {
  Run& run = *run_;
  // One that has not made a step need not begin in order to stop.
  if (immediately || run.written == 0) return run.ahead.end();
  const bool changed = run.change && run.change->plan.run_steps() <= run.ahead.run_steps();
  run.ahead.ramp_down(changed ? run.change->plan : run.by_ticks);
  run.change.reset();
  keep_delay_of(run.ahead);
}

void SerialPulseMaster::end_run(std::int64_t now_us) {
  if (run_->planned) {
    advance_ticks(now_us, true);
    base_tick_ = run_->tick;
    base_us_ = now_us;
  }
  position_ = run_->from_steps + run_->direction * std::int64_t{run_->gone};
  if (run_->limited) limit_us_[run_->direction > 0] = now_us;
  if (run_->pace) health_.clock_offset_us = 0;
  run_.reset();
  report_due_us_ = now_us;
}

void SerialPulseMaster::drop(McuIndex, std::uint8_t) {
  if (!run_ || !run_->planned) return;
  if (run_->ahead.left() > 0 || run_->pace) leave_plan(now_us_, false);
}

void SerialPulseMaster::emergency_stop(bushd_stop_mode mode) {
  faults_ |= BUSHD_FAULT_EMERGENCY;
  view_.bound_by_stop = true;
  if (run_) leave_plan(now_us_, mode == BUSHD_STOP_IMMEDIATE);
  report_due_us_ = 0;
  wake_us_ = 0;
}

// --- Requests

void SerialPulseMaster::reconfigure(McuIndex, link::McuSetup setup) {
  setup_.mcus[0] = std::move(setup);
  if (view_.phase == link::McuPhase::kOnline) events_.push_back(link::McuOnline{kMcu});
}

void SerialPulseMaster::control(McuIndex, std::uint8_t actions) {
  if ((actions & BUSHD_CONTROL_CLEAR_FAULTS) != 0 && !run_) {
    faults_ = 0;
    view_.bound_by_stop = false;
  }
  // There is nothing that could disable the driver.
  if ((actions & BUSHD_CONTROL_DISABLE) != 0) {
    events_.push_back(link::RequestRefused{kMcu, BUSHD_MSG_CONTROL, BUSHD_E_STATE});
  }
  requests_open_ = true;
  report_due_us_ = wake_us_ = 0;
}

void SerialPulseMaster::set_position(McuIndex, std::uint8_t, std::int32_t position_steps) {
  if (!run_) position_ = position_steps;
  requests_open_ = true;
  report_due_us_ = wake_us_ = 0;
}

void SerialPulseMaster::report(std::int64_t now_us) {
  const bool begun = run_ && (!run_->planned || run_->tick >= run_->start);
  const bushd_set_inputs& inputs = setup_.mcus[0].inputs;
  std::int64_t position = position_;
  view_.tick = std::max(view_.tick, tick_at(now_us));
  if (run_) {
    const std::uint32_t made = run_->planned ? run_->by_ticks.made() : run_->gone;
    position = run_->from_steps + run_->direction * std::int64_t{made};
  }
  bushd_report report{};
  report.state = faults_ != 0 ? BUSHD_STATE_FAULT : begun ? BUSHD_STATE_RUN : BUSHD_STATE_READY;
  report.faults = faults_;
  report.flags = BUSHD_FLAG_ENABLED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_CONFIGURED;
  report.boot_number = view_.identity.boot_number;
  report.tick = static_cast<std::uint32_t>(view_.tick);
  report.moving = begun ? 1 : 0;
  report.running = report.moving;
  report.inputs = static_cast<std::uint16_t>((status_->lines ^ inputs.inverted) & 0x0F);
  report.low_water_ticks = UINT16_MAX;
  report.forbidden_positive = forbidden(1) ? 1 : 0;
  report.forbidden_negative = forbidden(-1) ? 1 : 0;
  report.autonomous = homing_ ? 1 : 0;
  report.homed = homed_ ? 1 : 0;
  report.homing = static_cast<std::uint8_t>(homing_ ? homing_->stage : last_homing_);
  report.motor_count = 1;
  report.motor[0].position_steps = static_cast<std::int32_t>(position);
  view_.report = report;
  view_.reported = true;
  requests_open_ = false;
  report_due_us_ = now_us + (run_ || homing_ ? kReportUs : kRestingReportUs);
  events_.push_back(link::McuReported{kMcu});
}

}  // namespace bushd::serial_pulse
