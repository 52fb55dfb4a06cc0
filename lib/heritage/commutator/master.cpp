#include "heritage/commutator/master.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/table.h"

namespace bushd::commutator {
namespace {

constexpr link::McuIndex kBoard{0};
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kReportMovingUs = 10'000;
constexpr std::int64_t kReportUs = 100'000;
constexpr std::int64_t kRetryUs = 1'000'000;  // after a fault of the board
constexpr std::int64_t kLeastSettleUs = 50'000;
constexpr link::Tick kStartTicks = 2;  // from now, so that a start is never over when it is asked

std::uint16_t bit_of(std::uint8_t motor) {
  return static_cast<std::uint16_t>(1u << motor);
}

void set_bit(std::uint16_t& mask, std::uint8_t motor, bool on) {
  mask = static_cast<std::uint16_t>(on ? mask | bit_of(motor) : mask & ~bit_of(motor));
}

// FNV-1a of its name.
void name_it(bushd_identity& identity, const std::string& name) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : name) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211u;
  for (std::uint8_t& byte : identity.unique_id) {
    byte = static_cast<std::uint8_t>(hash);
    hash >>= 8;
  }
}

}  // namespace

CommutatorMaster::CommutatorMaster(Setup setup, link::BusSetup bus, link::TickSource& source)
    : tick_ns_(bus.tick_ns),
      has_converter_(setup.board.converter.has_value()),
      settle_us_(std::max(Exchange(setup.board).longest_us(), kLeastSettleUs)),
      source_(source),
      exchange_(setup.board) {
  board_.setup = std::move(bus.mcus.front());
  board_.view.detail = "its port is not open";
  bushd_identity& identity = board_.view.identity;
  identity.protocol_version = BUSHD_PROTOCOL_VERSION;
  identity.motors = kMotors;
  // Positions are counted here: another daemon's are those of another boot.
  identity.boot_number = bus.master;
  name_it(identity, setup.name);
  bushd_report& report = board_.view.report;
  report.flags = BUSHD_FLAG_ENABLED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_CONFIGURED;
  report.boot_number = bus.master;
  report.low_water_ticks = UINT16_MAX;
  report.motor_count = kMotors;
}

// --- The plan's time

std::int64_t CommutatorMaster::plan_ns(std::int64_t now_us) const {
  const std::int64_t free_ns = clock_ns_ + std::max<std::int64_t>(now_us - clock_us_, 0) * 1000;
  if (!motion_ || motion_->steps.has_left_plan() || motion_->cut) return free_ns;
  if (motion_->asked) return std::min(free_ns, std::max(motion_->asked->at_ns - 1, clock_ns_));
  return std::min(free_ns, std::max(motion_->steps.start() * tick_ns_, clock_ns_));
}

std::int64_t CommutatorMaster::us_of_plan(std::int64_t plan_ns) const {
  return clock_us_ + std::max<std::int64_t>((plan_ns - clock_ns_ + 999) / 1000, 0);
}

void CommutatorMaster::set_clock(std::int64_t now_us, std::int64_t plan_ns) {
  clock_us_ = now_us;
  clock_ns_ = plan_ns;
}

link::Tick CommutatorMaster::earliest_start(std::int64_t now_us, link::McuIndex,
                                            std::uint8_t) const {
  return tick_at(now_us) + kStartTicks;
}

link::Tick CommutatorMaster::earliest_replace(std::int64_t now_us,
                                              std::span<const link::ToReplace>) const {
  const link::Tick next = tick_at(now_us) + 1;
  return motion_ ? std::max(next, motion_->steps.committed()) : next;
}

link::Tick CommutatorMaster::earliest_retarget(std::int64_t now_us,
                                               std::span<const link::ToReplace> together,
                                               link::Tick start) const {
  const bool begun = motion_ && motion_->asked;
  return begun ? earliest_replace(now_us, together)
               : std::max(start, earliest_start(now_us, kBoard, 0));
}

// --- Bytes and time

void CommutatorMaster::port_opened(std::int64_t now_us) {
  port_open_ = true;
  exchange_.forget();
  set_clock(now_us, plan_ns(now_us));
  board_.view.phase = link::McuPhase::kConnecting;
  board_.view.detail = "its port has just been opened";
  online_us_ = now_us + settle_us_;
}

void CommutatorMaster::port_lost(std::int64_t now_us, const std::string& cause) {
  port_open_ = false;
  if (motion_ && motion_->asked && !exchange_.cancel()) {
    uncertain(motion_->motor,
              "its port was lost with a step under way, which may have been made or not, and it "
              "stopped without its ramp");
  } else if (motion_ && motion_->asked) {
    uncertain(motion_->motor, "its port was lost, and it stopped without its ramp");
  }
  go_offline(now_us, cause);
  online_us_.reset();
}

void CommutatorMaster::receive(std::int64_t now_us, std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) handle(now_us, exchange_.receive(now_us, byte));
}

std::span<const std::uint8_t> CommutatorMaster::step(std::int64_t now_us) {
  if (!port_open_) return {};
  handle(now_us, exchange_.advance(now_us));
  if (online_us_ && now_us >= *online_us_) go_online(now_us);
  ask(now_us);
  if (board_.view.phase == link::McuPhase::kOnline && (report_wanted_ || now_us >= report_us_)) {
    take_report(now_us);
    events_.emplace_back(link::McuReported{kBoard});
  }
  out_ = exchange_.take_bytes();
  return out_;
}

std::int64_t CommutatorMaster::next_wake_us() const {
  if (!port_open_) return kNever;
  std::int64_t wake = exchange_.next_wake_us();
  if (online_us_) wake = std::min(wake, *online_us_);
  if (board_.view.phase != link::McuPhase::kOnline) return wake;
  if (motion_ && !motion_->asked) {
    wake = std::min(wake, us_of_plan(motion_->steps.start() * tick_ns_));
  }
  return std::min(wake, report_wanted_ ? 0 : report_us_);
}

std::vector<link::Event> CommutatorMaster::take_events() {
  return std::exchange(events_, {});
}

// --- The exchange

void CommutatorMaster::handle(std::int64_t now_us, const Exchange::Event& event) {
  if (event.stray) ++health_.stray_frames;
  if (event.answer) answered(now_us, event.answer->status);
  if (event.lost) lost(now_us, event.lost->cause);
}

void CommutatorMaster::ask(std::int64_t now_us) {
  if (!motion_ || !exchange_.free()) return;
  Motion& motion = *motion_;
  const bool begins = !motion.asked && !motion.cut;
  if (begins && plan_ns(now_us) < motion.steps.start() * tick_ns_) return;
  // The first delay begins now, however late that is.
  if (begins) {
    set_clock(now_us, plan_ns(now_us));
    exchange_.begin_motion();
  }
  const auto next = motion.cut ? std::nullopt : motion.steps.take();
  if (!next) return end_motion();
  motion.asked = next;
  exchange_.step(now_us, motion.motor, next->direction < 0, paced(now_us, next->delay_ns));
}

// The delay of the next step: that of the plan, or longer on the way up again after a pause.
std::uint64_t CommutatorMaster::paced(std::int64_t now_us, std::uint64_t delay_ns) {
  Motion& motion = *motion_;
  const auto slot = board_.setup.table_of_motor.at(motion.motor);
  const bushd_table& table = *board_.setup.tables.at(*slot).table;
  const auto accel_ns = [&table](std::uint32_t i) {
    return std::uint64_t{table.accel.code[i]} * table.time_unit_ns;
  };
  if (motion.delay_ns != 0) {
    const auto taken_ns =
        static_cast<std::uint64_t>(std::max<std::int64_t>(now_us - motion.sent_us, 0)) * 1000;
    const std::uint64_t late_ns = taken_ns - std::min(taken_ns, motion.delay_ns);
    const std::uint64_t interval_ns = delay_ns + late_ns;
    if (motion.interval_ns < accel_ns(0) && late_ns > accel_ns(0)) {
      uncertain(motion.motor,
                fmt::format("there was a pause of {} ms between two steps at speed, so it stood, "
                            "and may have lost steps",
                            interval_ns / 1'000'000));
      motion.steps_since_pause = 0;
    }
    motion.interval_ns = interval_ns;
  }
  if (motion.steps_since_pause < table.accel.count) {
    // The pause was the first delay.
    const std::uint32_t i = motion.steps_since_pause++;
    if (i != 0) delay_ns = std::max(delay_ns, accel_ns(i));
  }
  motion.sent_us = now_us;
  motion.delay_ns = delay_ns;
  return delay_ns;
}

void CommutatorMaster::answered(std::int64_t now_us, const Status& status) {
  Motion& motion = *motion_;
  const std::uint8_t motor = motion.motor;
  const bool planned = !motion.steps.has_left_plan() && !motion.cut;
  const PlannedSteps::Step step = *motion.asked;
  if (status.step_done) {
    position_.at(motor) += step.direction;
    if (planned) {
      recent_.push_back(step);
      recent_motor_ = motor;
    }
  }
  if (planned) set_clock(now_us, step.at_ns);
  take_limits(status, motor);
  if (!status.step_done || status.supply_missing || status.not_connected) {
    const std::string what = status.supply_missing  ? "the motor's supply is missing"
                             : status.not_connected ? "the motor is not connected"
                             : status.no_pulse ? "the board's converter gave no pulse within 1 s"
                                               : "the board did not make a step";
    uncertain(motor, what + ", and it stopped without its ramp");
    end_motion();
    // Until it is tried again.
    if (status.supply_missing) set_powered(false);
    return go_offline(now_us, what);
  }
  if (!(step.direction > 0 ? status.right_limit : status.left_limit)) return;
  report_wanted_ = true;
  if ((board_.setup.inputs.limit_immediate & bit_of(motor)) != 0) {
    cut();
  } else if (planned) {
    leave_plan();
  }
}

void CommutatorMaster::take_limits(const Status& status, std::uint8_t motor) {
  bushd_report& report = board_.view.report;
  set_bit(report.forbidden_positive, motor, status.right_limit);
  set_bit(report.forbidden_negative, motor, status.left_limit);
}

void CommutatorMaster::set_powered(bool on) {
  std::uint8_t& flags = board_.view.report.flags;
  flags = static_cast<std::uint8_t>(on ? flags | BUSHD_FLAG_ENABLED : flags & ~BUSHD_FLAG_ENABLED);
}

void CommutatorMaster::lost(std::int64_t now_us, const std::string& cause) {
  ++board_.health.timeouts;
  uncertain(motion_->motor, cause +
                                " to a step, which may have been made or not, and it stopped "
                                "without its ramp");
  go_offline(now_us, cause);
}

// From now on reports tell where it is, not where it is in its plan.
void CommutatorMaster::leave_plan() {
  recent_.clear();
  motion_->steps.leave_plan();
}

void CommutatorMaster::cut() {
  recent_.clear();
  motion_->cut = true;
}

void CommutatorMaster::end_motion() {
  motion_.reset();
  report_wanted_ = true;
}

void CommutatorMaster::uncertain(std::uint8_t motor, std::string reason) {
  board_.view.uncertain_reason = std::move(reason);
  events_.emplace_back(link::PositionUncertain{kBoard, motor});
}

void CommutatorMaster::go_offline(std::int64_t now_us, std::string detail) {
  motion_.reset();
  recent_.clear();
  exchange_.forget();
  set_clock(now_us, plan_ns(now_us));
  board_.view.detail = std::move(detail);
  online_us_ = now_us + std::max(kRetryUs, settle_us_);
  if (board_.view.phase == link::McuPhase::kOnline) {
    events_.emplace_back(link::McuOffline{kBoard});
  }
  board_.view.phase = link::McuPhase::kOffline;
}

void CommutatorMaster::go_online(std::int64_t now_us) {
  online_us_.reset();
  board_.view.phase = link::McuPhase::kOnline;
  board_.view.detail.clear();
  board_.view.identified = true;
  set_powered(true);
  take_report(now_us);
  events_.emplace_back(link::McuOnline{kBoard});
}

void CommutatorMaster::take_report(std::int64_t now_us) {
  link::McuView& view = board_.view;
  bushd_report& report = view.report;
  view.tick = std::max(view.tick, tick_at(now_us));
  report.tick = static_cast<std::uint32_t>(view.tick);
  // Steps after the beginning of that tick are told by a later report.
  std::erase_if(recent_, [&](const auto& step) { return step.at_ns <= view.tick * tick_ns_; });
  for (std::uint8_t motor = 0; motor < kMotors; ++motor) {
    report.motor[motor].position_steps = static_cast<std::int32_t>(position_.at(motor));
    view.known_until.at(motor) = view.tick;
    report.motor[motor].known_until = static_cast<std::uint16_t>(view.tick);
  }
  for (const PlannedSteps::Step& step : recent_) {
    report.motor[recent_motor_].position_steps -= step.direction;
  }
  report.moving = recent_.empty() ? 0 : bit_of(recent_motor_);
  if (motion_ && motion_->asked) report.moving = bit_of(motion_->motor);
  report.state = report.faults != 0   ? BUSHD_STATE_FAULT
                 : report.moving != 0 ? BUSHD_STATE_RUN
                                      : BUSHD_STATE_READY;
  view.reported = true;
  view.outdated_us = 0;
  report_wanted_ = false;
  report_us_ = now_us + (report.moving != 0 ? kReportMovingUs : kReportUs);
}

// --- Motion

void CommutatorMaster::begin(link::McuIndex, std::uint8_t motor, link::Tick start) {
  if (motion_) {
    events_.emplace_back(link::StartMissed{kBoard, motor});
    return;
  }
  recent_.clear();
  motion_.emplace(Motion{
      .motor = motor,
      .steps = PlannedSteps(source_, kBoard, motor, static_cast<std::uint32_t>(tick_ns_), start)});
}

void CommutatorMaster::replace(link::McuIndex, std::uint16_t motors, link::Tick first) {
  if (!motion_ || (motors & bit_of(motion_->motor)) == 0 || motion_->steps.has_left_plan()) return;
  if (motion_->asked && first < motion_->steps.committed()) {
    events_.emplace_back(link::ReplacementFailed{kBoard, bit_of(motion_->motor)});
  }
}

void CommutatorMaster::drop(link::McuIndex, std::uint8_t motor) {
  if (!motion_ || motion_->motor != motor || motion_->steps.has_left_plan()) return;
  if (!motion_->asked) return end_motion();
  leave_plan();
}

void CommutatorMaster::emergency_stop(bushd_stop_mode mode) {
  board_.view.bound_by_stop = true;
  board_.view.report.faults |= BUSHD_FAULT_EMERGENCY;
  report_wanted_ = true;
  if (!motion_) return;
  if (!motion_->asked) return end_motion();
  if (mode == BUSHD_STOP_RAMP) return leave_plan();
  cut();
  exchange_.cancel();
}

// --- Requests

void CommutatorMaster::reconfigure(link::McuIndex, link::McuSetup setup) {
  board_.setup = std::move(setup);
  if (board_.view.phase != link::McuPhase::kOnline) return;
  board_.view.phase = link::McuPhase::kConnecting;
  board_.view.detail = "it is being given another table";
  online_us_ = clock_us_;
}

Result<void> CommutatorMaster::check_room(link::McuIndex, const link::McuSetup& setup) const {
  const std::uint64_t per_s = exchange_.most_steps_per_s();
  for (const link::TableRef& ref : setup.tables) {
    const std::uint64_t fastest_ns =
        std::uint64_t{ref.table->time_unit_ns} * bushd_table_fastest(ref.table);
    if (fastest_ns * per_s >= 1'000'000'000) continue;
    return fail(fmt::format(
        "makes steps no closer together than one {}, {} ns by its {}, and its motors' tables have "
        "steps {} ns apart: use a slower table",
        has_converter_ ? "period of its converter" : "delay code", 1'000'000'000 / per_s,
        has_converter_ ? "max_hz" : "start_hz", fastest_ns));
  }
  return {};
}

// Windings stay on: a board has nothing to switch them off with.
void CommutatorMaster::control(link::McuIndex, std::uint8_t actions) {
  report_wanted_ = true;
  const bool refused = (actions & BUSHD_CONTROL_DISABLE) != 0 ||
                       ((actions & BUSHD_CONTROL_CLEAR_FAULTS) != 0 && motion_);
  if (refused) {
    events_.emplace_back(link::RequestRefused{kBoard, BUSHD_MSG_CONTROL, BUSHD_E_STATE});
  } else if ((actions & BUSHD_CONTROL_CLEAR_FAULTS) != 0) {
    board_.view.report.faults = 0;
    board_.view.bound_by_stop = false;
  }
}

void CommutatorMaster::set_position(link::McuIndex, std::uint8_t motor,
                                    std::int32_t position_steps) {
  position_.at(motor) = position_steps;
  report_wanted_ = true;
}

}  // namespace bushd::commutator
