#include "conformance/pulse_bench.h"

#include <algorithm>
#include <utility>

namespace bushd::test {
namespace {

constexpr std::uint32_t kTickNs = 2'560'000;

std::vector<std::uint16_t> codes(int count) {
  std::vector<std::uint16_t> all;
  for (int i = 0; i < count; ++i) {
    all.push_back(static_cast<std::uint16_t>(25'000 / (100 + 2400 * i / count)));
  }
  return all;
}

}  // namespace

std::vector<PortTarget> port_targets() {
  return {{.name = "Uart", .base = 115'200},
          {.name = "AnyRate"},
          {.name = "FixedRates", .any_rate = false},
          {.name = "AdapterOfPackets", .packet_us = 1'000},
          {.name = "AdapterThatTellsNothing", .tells_empty = false, .packet_us = 1'000},
          {.name = "FixedRatesThatTellNothing", .any_rate = false, .tells_empty = false}};
}

PulseBench::PulseBench(const PortTarget& target, bool limit_immediate)
    : target_(target),
      accel_(codes(60)),
      decel_(codes(40)),
      limit_immediate_(limit_immediate),
      axis_(table_, kTickNs, BUSHD_FORMAT_FINE),
      drive_(this) {
  table_.accel.code = accel_.data();
  table_.accel.count = static_cast<std::uint16_t>(accel_.size());
  table_.decel.code = decel_.data();
  table_.decel.count = static_cast<std::uint16_t>(decel_.size());
  table_.cruise = kCruise;
  table_.time_unit_ns = kUnitNs;
  start_master();
  run_for(0.1);
}

PulseBench::~PulseBench() {
  EXPECT_EQ(drive_.faults(), 0u) << "a rate or the direction was changed amid bytes";
}

void PulseBench::start_master() {
  link::BusSetup setup{
      .tick_ns = kTickNs, .format = BUSHD_FORMAT_FINE, .master = ++boot_, .mcus = {}};
  link::McuSetup mcu;
  mcu.tables = {{.table = &table_}};
  mcu.table_of_motor[0] = 0;
  mcu.inputs.limit_positive = mcu.inputs.limit_negative = 1;
  mcu.inputs.limit_immediate = limit_immediate_ ? 1 : 0;
  mcu.motor_inputs = {{.motor = 0, .positive = 1, .negative = 2, .home = 0}};
  setup.mcus.push_back(mcu);
  master_ = std::make_unique<serial_pulse::SerialPulseMaster>(
      std::move(setup), static_cast<link::TickSource&>(*this), 4711);
  master_->port_opened(now_us_);
  open_ = true;
}

void PulseBench::restart() {
  axis_.finish();
  start_master();
}

void PulseBench::edge(const sim::Edge& edge) {
  if (edge.signal == sim::Signal::kDir) {
    if (last_step_ns_) {
      EXPECT_GE(edge.time_ns - *last_step_ns_, kDirectionNs) << "behind a step";
    }
    direction_ns_ = edge.time_ns;
  } else if (edge.level) {
    if (direction_ns_) {
      EXPECT_GE(edge.time_ns - *direction_ns_, kDirectionNs) << "before a step";
    }
    last_step_ns_ = edge.time_ns;
  }
}

// --- Time

void PulseBench::run_for(double seconds) {
  run_until(now_us_ + static_cast<std::int64_t>(seconds * 1e6));
}

void PulseBench::pause(double seconds) {
  const std::int64_t until_us = now_us_ + static_cast<std::int64_t>(seconds * 1e6);
  if (target_.packet_us > 0) {  // the adapter does not stand still
    now_us_ = std::min(until_us, (now_us_ / target_.packet_us + 1) * target_.packet_us);
    pass_on();
  }
  now_us_ = until_us;
  pass_on();
  drive_.advance_to(now_us_ * 1000);
}

void PulseBench::run_until(std::int64_t limit_us) {
  while (now_us_ < limit_us) {
    pass_on();
    drive_.advance_to(now_us_ * 1000);
    master_->step(now_us_);
    if (const link::PulseOrder* order = master_->pulse_order(); order != nullptr && open_) {
      carry_out(*order);
    }
    for (const link::Event& event : master_->take_events()) {
      events_.push_back(event);
      if (std::holds_alternative<link::McuReported>(event)) take_report();
    }
    std::int64_t next_us = std::clamp(master_->next_wake_us(), now_us_ + 1, limit_us);
    if (!held_.empty() && target_.packet_us > 0) {
      next_us = std::min(next_us, (now_us_ / target_.packet_us + 1) * target_.packet_us);
    }
    now_us_ = next_us;
  }
}

// --- The port

void PulseBench::carry_out(const link::PulseOrder& order) {
  if (order.positive) drive_.set_direction(now_us_ * 1000, *order.positive);
  if (order.baud) {
    // An UART divides its clock by the nearest whole number; the rate that it makes is rounded up.
    std::uint32_t made = *order.baud;
    if (target_.base > 0) {
      const std::uint32_t n = std::max((target_.base + made / 2) / made, 1u);
      made = (target_.base + n - 1) / n;
    }
    drive_.set_baud(now_us_ * 1000, made);
  }
  held_.insert(held_.end(), order.bytes.begin(), order.bytes.end());
  if (target_.packet_us == 0) pass_on();
  link::PulseStatus status{.any_rate = target_.any_rate, .base = target_.base};
  status.baud = drive_.baud();
  if (target_.tells_empty) {
    // What the driver has not sent: not what is in the UART.
    status.queued = std::max<std::size_t>(drive_.queued(), 1) - 1 + held_.size();
    status.empty = drive_.queued() + held_.size() == 0;
  } else if (stalled_) {
    status.queued = held_.size();  // then they are the driver's still
  }
  status.lines = drive_.lines();
  status.positive = drive_.positive();
  master_->pulse_status(now_us_, status);
}

void PulseBench::pass_on() {
  if (stalled_ || held_.empty()) return;
  if (target_.packet_us > 0 && now_us_ % target_.packet_us != 0) return;
  drive_.send(now_us_ * 1000, std::exchange(held_, {}));
}

void PulseBench::stall(bool stalled) {
  stalled_ = stalled;
}

void PulseBench::lose_port() {
  drive_.break_off(now_us_ * 1000);
  held_.clear();
  open_ = false;
  master_->port_lost(now_us_, "unplugged");
  axis_.finish();
}

void PulseBench::open_port() {
  open_ = true;
  master_->port_opened(now_us_);
}

// --- Motion

// What is reported of a tick is true of it: until the motor leaves its plan, for good.
void PulseBench::take_report() {
  if (!axis_.busy()) return;
  const int direction = axis_.direction();
  const bool forbidden =
      ((direction > 0 ? report().forbidden_positive : report().forbidden_negative) & 1) != 0;
  if (report().faults != 0 || (forbidden && report().moving == 0)) {
    axis_.finish();
    return;
  }
  if (forbidden) return;
  const link::Tick tick = master_->view({0}).tick;
  axis_.executed(tick);
  EXPECT_EQ(counted(), axis_.executed_steps()) << "at tick " << tick;
  if (axis_.needs_change()) replan();
}

void PulseBench::begin(std::int64_t steps, std::uint16_t shortest_delay) {
  const link::Tick start = master_->earliest_start(now_us_, {0}, 0);
  axis_.start(counted(), steps, start, 0, shortest_delay);
  master_->begin({0}, 0, start);
}

void PulseBench::replan() {
  const link::Tick at = axis_.stopping()
                            ? master_->earliest_replace(now_us_, {})
                            : master_->earliest_retarget(now_us_, {}, axis_.start_tick());
  if (axis_.change(at)) master_->replace({0}, 1, at);
}

void PulseBench::stop() {
  if (!axis_.busy()) return;
  axis_.stop();
  if (axis_.needs_change()) replan();
}

void PulseBench::aim(std::int64_t target, std::uint16_t shortest_delay) {
  axis_.aim(target, shortest_delay);
  if (axis_.needs_change()) replan();
}

void PulseBench::finish(double limit_s) {
  const std::int64_t limit_us = now_us_ + static_cast<std::int64_t>(limit_s * 1e6);
  while (now_us_ < limit_us) {
    run_for(0.01);
    if (!axis_.busy()) break;
    if (master_->view({0}).tick < axis_.over_tick() || report().moving != 0) continue;
    axis_.finish();
    break;
  }
  EXPECT_FALSE(axis_.busy()) << "it does not come to its end";
  run_for(0.15);
  expect_count();
}

bushd_homing PulseBench::home(int direction, double limit_s) {
  master_->home({0}, {.motor = 0,
                      .direction = static_cast<std::int8_t>(direction),
                      .most_steps = 3000,
                      .shortest_delay = 0,
                      .slow_steps = 200,
                      .slow_delay = 1000,
                      .position_steps = 0});
  run_for(0.05);
  const std::int64_t limit_us = now_us_ + static_cast<std::int64_t>(limit_s * 1e6);
  while (now_us_ < limit_us && report().autonomous != 0) run_for(0.01);
  run_for(0.15);
  const auto how = static_cast<bushd_homing>(report().homing);
  if (how == BUSHD_HOMING_DONE) origin_ = drive_.position_steps() - counted();
  return how;
}

void PulseBench::give_up_homing() {
  master_->home({0}, {});
}

void PulseBench::emergency_stop(bushd_stop_mode mode) {
  master_->emergency_stop(mode);
  axis_.finish();
}

void PulseBench::set_position(std::int32_t steps) {
  master_->set_position({0}, 0, steps);
  run_for(0.15);
  origin_ = drive_.position_steps() - steps;
}

void PulseBench::clear_faults() {
  master_->control({0}, BUSHD_CONTROL_CLEAR_FAULTS);
  run_for(0.15);
}

// The step under way of a run that is stopped in its ramp-down may count as the last one of equal
// codes: those before it are as many places farther from the end than they were planned at.
std::size_t PulseBench::most_left_out(std::size_t to_go) const {
  std::size_t most = 0;
  std::size_t equal = 0;
  for (std::size_t i = 1; i <= to_go && i < decel_.size(); ++i) {
    equal = decel_[i] == decel_[i - 1] ? equal + 1 : 0;
    most = std::max(most, equal);
  }
  return most;
}

void PulseBench::expect_run(std::size_t from, std::int64_t shortest_delay, bool stopped) {
  const auto& times = drive_.step_times_ns();
  const std::size_t steps = times.size() - from;
  const auto side = [](const std::vector<std::uint16_t>& codes, std::size_t i) {
    return i < codes.size() ? std::int64_t{codes[i]} : kCruise;
  };
  for (std::size_t j = 2; j <= steps; ++j) {
    const std::size_t to_go = steps - j + (stopped ? most_left_out(steps - j) : 0);
    const std::int64_t least =
        std::max({side(accel_, j - 1), side(decel_, to_go), kCruise, shortest_delay}) * kUnitNs;
    ASSERT_GE(times[from + j - 1] - times[from + j - 2] + 1, least)
        << "before step " << j << " of " << steps;
  }
}

}  // namespace bushd::test
