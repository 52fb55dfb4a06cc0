#include "daemon/services/camac_shutter.h"

#include <algorithm>
#include <functional>

#include "daemon/services/camac_motors.h"

namespace bushd::daemon {
namespace {

constexpr std::uint32_t kTravelUnitNs = camac::Travel::kUnitUs * 1000;

bool is_done(const api::Reply& reply, api::Outcome wanted) {
  const auto* completed = std::get_if<api::Completed>(&reply);
  return completed != nullptr && completed->outcome == wanted;
}

// An MCU prepares ticks ahead, so a run cannot begin sooner after an edge.
std::int64_t least_first_delay_us(const config::Bus& bus) {
  return std::int64_t{BUSHD_TRIGGER_FIXED_TICKS + 1} * bus.tick_us;
}

// Whether a switch is active, as debounced: what a motor has met it may not meet any more.
bool is_active(const bushd_report& report, const std::optional<config::Input>& input) {
  return input && (report.inputs >> input->number & 1) != 0;
}

// Else it is over, and its result comes when the motor stands.
bool is_under_way(const bushd_report& report) {
  return report.homing >= BUSHD_TRAVEL_STEPS && report.homing <= BUSHD_TRAVEL_RETURN;
}

// The stages in which the MCU makes the return, or is about to.
bool is_return(const bushd_report& report) {
  return report.homing == BUSHD_TRAVEL_RETURN_DELAY || report.homing == BUSHD_TRAVEL_RETURN;
}

}  // namespace

Result<tables::TablePtr> table_of_travel(const camac::Travel& travel, const std::string& module) {
  const auto& codes = travel.codes;
  auto slower = std::ranges::is_sorted_until(codes, std::greater<>());
  // Neither side of a table is empty.
  if (slower == codes.end() && codes.size() > 1) --slower;
  tables::TableContent content{.name = module, .time_unit_ns = kTravelUnitNs};
  content.accel.assign(codes.begin(), slower);
  content.decel.emplace(slower, codes.end());
  if (content.decel->empty()) content.decel = content.accel;
  content.cruise = std::ranges::min(codes);
  content.name += "-" + tables::content_hash(content).substr(0, tables::kShortHashLength);
  return tables::make(std::move(content));
}

bool CamacShutter::refuse(const std::string& why) {
  warn(motor_, installation_[motor_].name() + ": " + why);
  return false;
}

Result<void> CamacShutter::may_begin(std::int64_t steps) const {
  const motion::Motor& motor = installation_[motor_];
  if (auto may = interlocks_.may_move(motor_); !may) return may;
  if (motor.has_plan()) return fail("moves, by another's request");
  return motor.reach().may_move_to(motor.position_steps() + steps);
}

bool CamacShutter::takes(Motion motion, const Result<void>& may) {
  if (!may) return refuse(may.error().text());
  motion_ = std::move(motion);
  motion_->after_stops = turn_.after_stops;
  return true;
}

bool CamacShutter::step(const camac::SingleStep& step) {
  const bool sensed = step.with_sensor;
  if (sensed && !installation_.config()[motor_].inputs.step) {
    return refuse("it has no step sensor; add 'step' to its 'inputs', or use mode 00");
  }
  if (sensed && !installation_.mcu_of(motor_).can_travel()) {
    return refuse("the firmware of its MCU does not watch a step sensor; use mode 00");
  }
  return takes({.kind = sensed ? Motion::Kind::kSensedStep : Motion::Kind::kStep, .step = step},
               may_begin(step.left ? -1 : 1));
}

bool CamacShutter::travel(const camac::Travel& travel) {
  const Mcu& mcu = installation_.mcu_of(motor_);
  if (!mcu.can_travel()) {
    return refuse("the firmware of its MCU does not travel between limits by itself; use mode 00");
  }
  if (travel.synchronous && !mcu.can_trigger()) {
    return refuse("its MCU has no trigger input for the reactor start; use mode 10");
  }
  const config::Config& config = installation_.config();
  const std::int64_t least_us = least_first_delay_us(config.bus_of(config[motor_]));
  if (travel.adjusts_opening() && travel.first_run_delay_us() < least_us) {
    return refuse("its MCU opens " + std::to_string(least_us) +
                  " us after a reactor start at the earliest, and the delay at addresses 2, 3 is " +
                  std::to_string(travel.first_run_delay_us()) + " us; write " +
                  std::to_string((least_us + camac::Travel::kUnitUs - 1) / camac::Travel::kUnitUs) +
                  " or more there");
  }
  const bool as_written = !camac::rise_and_fall_once(travel.codes);
  const bool alone = as_written || without_computer_;
  if (const auto may = may_have_program(mcu, as_written); alone && !may) {
    return refuse(may.error().text());
  }
  tables::TablePtr by;
  if (!alone) {
    auto table = table_of_travel(travel, name_);
    if (!table) return refuse(table.error().text());
    by = std::move(*table);
  }
  const auto steps = static_cast<std::int64_t>(travel.codes.size());
  const bool taken = takes(
      {.kind = Motion::Kind::kTravel, .travel = travel, .table = std::move(by), .alone = alone},
      may_begin(travel.left ? -steps : steps));
  if (!taken || !as_written) return taken;
  const std::int64_t fastest_ns = std::ranges::min(travel.codes) * std::int64_t{kTravelUnitNs};
  note(motor_, fastest_ns);
  return true;
}

void CamacShutter::stop() {
  if (motion_) motion_->to_stop = true;
}

void CamacShutter::end_overtaken() {
  if (!motion_ || motion_->stage == Motion::Stage::kGoes) return;
  if (!precedence_.overtaken(motion_->after_stops, {motor_})) return;
  motion_->to_stop = motion_->begins_no_more = true;
}

void CamacShutter::follow(std::int64_t now_us, camac::Bushd1& module) {
  tell_limits(module);
  if (!motion_) return;
  if (motion_->stage == Motion::Stage::kBegins &&
      (motion_->begins_no_more || (motion_->to_stop && motion_->alone))) {
    refuse("stopped before it began");
    motion_.reset();
    return module.stands();
  }
  if (motion_->stage == Motion::Stage::kBegins) begin(now_us);
  if (motion_->stage == Motion::Stage::kGetsTable) {
    follow_table(now_us, module);
  } else if (motion_->stage == Motion::Stage::kGoes) {
    follow_going(now_us, module);
  }
}

void CamacShutter::begin(std::int64_t now_us) {
  if (motion_->kind != Motion::Kind::kTravel) {
    motion_->stage = Motion::Stage::kGoes;
    if (motion_->kind == Motion::Kind::kSensedStep) return ask_mcu(now_us);
    return ask_(now_us, asker(motion_->after_stops),
                api::Move{.kind = api::Move::Kind::kRelative,
                          .motors = {{installation_[motor_].name(), motion_->left() ? -1 : 1}}});
  }
  if (motion_->alone) {
    // Its MCU takes codes at rest only.
    if (!installation_.rests(installation_.mcu_of(motor_))) return;
    motion_->stage = Motion::Stage::kGoes;
    return ask_mcu(now_us);
  }
  motion_->stage = Motion::Stage::kGetsTable;
  use_table(now_us, motor_, motion_->table, motion_->after_stops);
}

void CamacShutter::follow_table(std::int64_t now_us, camac::Bushd1& module) {
  const auto& reply = session_->last_answer();
  if (!reply) return;
  if (is_done(*reply, api::Outcome::kDone) && !motion_->to_stop) {
    motion_->stage = Motion::Stage::kGoes;
    return ask_mcu(now_us);
  }
  refuse(motion_->to_stop ? "stopped before it began"
                          : "its codes were not put in service: " + reason_of(*reply));
  motion_.reset();
  module.stands();
}

void CamacShutter::ask_mcu(std::int64_t now_us) {
  motion_->from_steps = installation_[motor_].position_steps();
  if (motion_->alone) {
    return program_.begin(now_us, installation_.mcu_of(motor_),
                          text_of(motion_->travel, installation_[motor_].name(), without_computer_),
                          motion_->after_stops);
  }
  bushd_travel message{};
  message.direction = motion_->left() ? -1 : 1;
  if (motion_->kind == Motion::Kind::kSensedStep) {
    message.kind = BUSHD_TRAVEL_STEP;
    message.sensor = installation_.config()[motor_].inputs.step->number;
    message.steps = 1;
    message.wait_us = camac::SingleStep::kSensorUs;
  } else {
    const camac::Travel& travel = motion_->travel;
    message.kind = BUSHD_TRAVEL_LIMITS;
    message.edge = travel.synchronous ? BUSHD_EDGE_RISING : BUSHD_EDGE_NONE;
    message.steps = static_cast<std::uint32_t>(travel.codes.size());
    message.delay_us =
        travel.synchronous ? static_cast<std::uint32_t>(travel.first_run_delay_us()) : 0;
    message.wait_us = static_cast<std::uint32_t>(travel.return_delay_us());
  }
  travels_.request(asker(motion_->after_stops), motor_, message);
}

void CamacShutter::follow_going(std::int64_t now_us, camac::Bushd1& module) {
  const bool heard =
      !motion_->alone || !program_.is_found() || installation_[motor_].is<motion::InProgram>();
  if (motion_->to_stop && !motion_->stopping && heard && motion_->kind != Motion::Kind::kStep) {
    motion_->stopping = true;
    ask_to_stop(now_us, motor_);
  }
  const std::optional<api::Reply> reply =
      motion_->alone ? program_.follow(now_us) : session_->last_answer();
  if (reply) return end(module, *reply);
  const bushd_report* report = progress();
  if (motion_->kind == Motion::Kind::kTravel && report != nullptr) follow_travel(*report, module);
}

std::optional<KeptMotion> CamacShutter::to_keep(const camac::Bushd1& module) const {
  const bool goes = motion_ && motion_->alone && motion_->stage == Motion::Stage::kGoes;
  if (!goes || !without_computer_ || !program_.runs()) return std::nullopt;
  const auto checksum = program_.checksum();
  if (!checksum) return std::nullopt;
  const auto steps = static_cast<std::uint32_t>(motion_->travel.codes.size());
  return KeptMotion{.control = module.control(),
                    .from_steps = travel_from(*motion_),
                    .steps = steps,
                    .checksum = *checksum};
}

// Where its first run has begun.
std::int64_t CamacShutter::travel_from(const Motion& motion) {
  if (!motion.returns) return motion.from_steps;
  const auto steps = static_cast<std::int64_t>(motion.travel.codes.size());
  return motion.from_steps - (motion.travel.left ? -steps : steps);
}

void CamacShutter::find(const KeptMotion& kept, camac::Bushd1& module) {
  if (!without_computer_ || kept.steps > camac::Bushd1::kMostSteps) return;
  module.goes_on(kept.control, static_cast<int>(kept.steps));
  Motion motion{.kind = Motion::Kind::kTravel,
                .alone = true,
                .stage = Motion::Stage::kGoes,
                .from_steps = kept.from_steps};
  motion.travel.left = module.goes_left();
  motion.travel.codes.resize(kept.steps, 1);
  motion_ = std::move(motion);
  program_.find(installation_.mcu_of(motor_).id, kept.checksum);
}

// What the MCU has reported last of the travel that is made.
const bushd_report* CamacShutter::progress() const {
  if (!motion_->alone) return travels_.progress(motor_);
  const Mcu& mcu = installation_.mcu_of(motor_);
  const bool runs = program_.runs() && installation_[motor_].is<motion::InProgram>();
  return runs && mcu.online() && !mcu.busy() ? &mcu.report() : nullptr;
}

// What happens between two reports is told in its order, whichever of it they show.
void CamacShutter::follow_travel(const bushd_report& report, camac::Bushd1& module) {
  if (motion_->stopping || !is_under_way(report)) return;
  const Motion::Start start{report.start_tick, report.start_ns};
  const bool unseen = report.homing == BUSHD_TRAVEL_ARMED && !motion_->returns && motion_->start &&
                      *motion_->start != start;
  if (is_return(report) ? !motion_->returns : unseen) end_run(module, *motion_);
  if (!is_return(report) && motion_->returns) end_run(module, *motion_);
  motion_->start = start;
  tell_steps(module, *motion_, false);
}

// All but the last one, which comes with the end of the run.
void CamacShutter::tell_steps(camac::Bushd1& module, Motion& motion, bool all) const {
  const auto steps = static_cast<std::int64_t>(motion.travel.codes.size());
  const std::int64_t moved = installation_[motor_].position_steps() - motion.from_steps;
  const std::int64_t made = all ? steps : std::min(motion.left() ? -moved : moved, steps - 1);
  for (; motion.told < made; ++motion.told) module.run_step_done();
}

// The MCU has seen its limit.
void CamacShutter::end_run(camac::Bushd1& module, Motion& motion) {
  const bool left = motion.left();
  const auto steps = static_cast<std::int64_t>(motion.travel.codes.size());
  tell_steps(module, motion, true);
  module.limits(!left, left);
  module.run_ends();
  motion.from_steps += left ? -steps : steps;
  motion.told = 0;
  motion.returns = !motion.returns;
}

// Whether a run has reached its limit in time is the MCU's to say, which sees more than reports
// show.
void CamacShutter::tell_limits(camac::Bushd1& module) {
  camac::MotorStatus limits = limits_of(installation_, motor_);
  const config::MotorInputs& inputs = installation_.config()[motor_].inputs;
  const bushd_report& report = installation_.mcu_of(motor_).report();
  limits.right_limit = limits.right_limit && is_active(report, inputs.positive);
  limits.left_limit = limits.left_limit && is_active(report, inputs.negative);
  const bool runs =
      motion_ && motion_->kind == Motion::Kind::kTravel && motion_->stage == Motion::Stage::kGoes;
  module.limits(limits.right_limit && !(runs && !motion_->left()),
                limits.left_limit && !(runs && motion_->left()));
}

void CamacShutter::end(camac::Bushd1& module, const api::Reply& reply) {
  Motion motion = std::move(*motion_);
  motion_.reset();
  const bool done = is_done(reply, api::Outcome::kReached);
  const bool told = motion.kind != Motion::Kind::kStep && !std::get_if<api::Refused>(&reply);
  if (!done && !told) warn(motor_, api::reason_of(reply));
  if (motion.kind == Motion::Kind::kTravel) return end_travel(module, motion, done);
  done ? module.step_done() : module.step_not_done();
}

void CamacShutter::end_travel(camac::Bushd1& module, Motion& motion, bool done) {
  if (done) {
    if (!motion.returns) end_run(module, motion);
    end_run(module, motion);
    return module.stands();  // a module that was told to stop waits for no more than this
  }
  const std::uint8_t stage = installation_.mcu_of(motor_).report().homing;
  const bool all = stage == BUSHD_TRAVEL_NOT_REACHED || stage == BUSHD_TRAVEL_NOT_LEFT;
  if (!motion.stopping) tell_steps(module, motion, all);
  tell_limits(module);
  if (all) module.run_ends();
  module.stands();
}

}  // namespace bushd::daemon
