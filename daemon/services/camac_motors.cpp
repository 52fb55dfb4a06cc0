#include "daemon/services/camac_motors.h"

#include <algorithm>
#include <functional>
#include <utility>

namespace bushd::daemon {
namespace {

using camac::Bushd2;
using camac::MotorStatus;
using camac::Program;

std::optional<api::Outcome> outcome_of(const api::Reply& reply) {
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return std::nullopt;
  return completed->outcome;
}

}  // namespace

Result<tables::TablePtr> table_of_program(const Program& program, int f_start_hz,
                                          const std::string& module) {
  const auto rise = std::ranges::is_sorted_until(program.codes, std::greater<>());
  tables::TableContent content{.name = module, .time_unit_ns = code_unit_ns(f_start_hz)};
  content.accel.assign(program.codes.begin(), rise);
  content.name += "-" + std::to_string(program.page) + "-" +
                  tables::content_hash(content).substr(0, tables::kShortHashLength);
  return tables::make(std::move(content));
}

MotorStatus limits_of(const Installation& installation, MotorId motor) {
  const Mcu& mcu = installation.mcu_of(motor);
  if (!mcu.online()) return {};
  const unsigned output = 1U << installation[motor].output().value;
  return {.right_limit = (mcu.report().forbidden_positive & output) != 0,
          .left_limit = (mcu.report().forbidden_negative & output) != 0};
}

std::int64_t CamacMotors::fastest_ns(const Program& program) const {
  const auto used = static_cast<std::ptrdiff_t>(camac::codes_used(program));
  const auto code = *std::min_element(program.codes.begin(), program.codes.begin() + used);
  return code * std::int64_t{code_unit_ns(config_.f_start_hz)};
}

MotorStatus CamacMotors::status(int number) {
  const auto index = static_cast<std::size_t>(number);
  if (index >= config_.motors.size()) {
    outputs_.log(LogLevel::kWarning, {},
                 name_ + ": there is no motor " + std::to_string(number) + "; it has " +
                     std::to_string(config_.motors.size()));
    return {.not_connected = true};
  }
  const MotorId id = config_.motors[index];
  const Mcu& mcu = installation_.mcu_of(id);
  MotorStatus status = limits_of(installation_, id);
  const bool supplied =
      !mcu.online() || mcu.asleep || (mcu.report().flags & BUSHD_FLAG_ENABLED) != 0;
  status.supply_missing = !supplied;
  if (const auto may = interlocks_.may_move(id); !may) {
    status.not_connected = supplied;
    warn(id, installation_[id].name() + ": " + may.error().text());
  }
  return status;
}

bool CamacMotors::move(const Program& program) {
  const MotorId id = config_.motors[static_cast<std::size_t>(program.motor)];
  const motion::Motor& motor = installation_[id];
  Result<void> may = motor.reach().may_be_used();
  if (may && motor.has_plan()) may = fail("moves, by another's request");
  const bool as_written = !falls_to_the_middle(program);
  const bool alone = as_written || config_.without_computer;
  if (may && alone) may = may_have_program(installation_.mcu_of(id), as_written);
  tables::TablePtr by;
  if (may && !alone) {
    auto table = table_of_program(program, config_.f_start_hz, name_);
    if (table) by = std::move(*table);
    if (!table) may = fail(table.error());
  }
  const std::int64_t steps = program.left ? -std::int64_t{program.steps} : program.steps;
  if (may) may = motor.reach().may_move_to(motor.position_steps() + steps);
  if (!may) {
    warn(id, motor.name() + ": " + may.error().text());
    return false;
  }
  motion_ = Motion{.motor = id,
                   .program = program,
                   .table = std::move(by),
                   .alone = alone,
                   .after_stops = turn_.after_stops};
  if (as_written) note(motion_->motor, fastest_ns(program));
  return true;
}

void CamacMotors::stop(int) {
  if (motion_) motion_->to_stop = true;
}

void CamacMotors::end_overtaken() {
  if (!motion_ || motion_->stage == Motion::Stage::kMoves) return;
  if (precedence_.overtaken(motion_->after_stops, {motion_->motor})) motion_->to_stop = true;
}

void CamacMotors::step(std::int64_t now_us, Bushd2& module) {
  if (!motion_) return;
  if (motion_->stage == Motion::Stage::kBegins && motion_->to_stop) {
    warn(motion_->motor, installation_[motion_->motor].name() + ": stopped before it began");
    motion_.reset();
    return module.ends({});
  }
  if (motion_->stage == Motion::Stage::kBegins) begin(now_us, module);
  if (motion_ && motion_->stage == Motion::Stage::kGetsTable) follow_table(now_us, module);
  if (motion_ && motion_->stage == Motion::Stage::kMoves) follow_move(now_us, module);
}

void CamacMotors::begin(std::int64_t now_us, Bushd2& module) {
  if (motion_->alone) {
    // Its MCU takes codes at rest only.
    if (installation_.rests(installation_.mcu_of(motion_->motor))) move(now_us, module, {});
    return;
  }
  if (streams()) return move(now_us, module, motion_->table);
  motion_->stage = Motion::Stage::kGetsTable;
  use_table(now_us, motion_->motor, motion_->table, motion_->after_stops);
}

// The MCU has another table and cannot take this one, because it moves other motors. It ramps the
// motor down by the table that it has; from a delay shorter than any of that it could not.
bool CamacMotors::streams() const {
  const GroupId group = installation_.config()[motion_->motor].group;
  const tables::Table& in_mcu = *installation_.tables()[group];
  if (in_mcu.content_hash() == motion_->table->content_hash()) return false;
  if (!installation_.mcu_of(motion_->motor).offers.streams || !tables_.waits_for_motors(group)) {
    return false;
  }
  const std::int64_t fastest_ns =
      std::int64_t{bushd_table_fastest(&in_mcu.view())} * in_mcu.view().time_unit_ns;
  const std::uint8_t fastest_code = motion_->program.codes[camac::codes_used(motion_->program) - 1];
  return fastest_code * std::int64_t{motion_->table->view().time_unit_ns} >= fastest_ns;
}

void CamacMotors::follow_table(std::int64_t now_us, Bushd2& module) {
  const auto& reply = session_->last_answer();
  if (!reply) return;
  if (outcome_of(*reply) == api::Outcome::kDone) return move(now_us, module, {});
  const MotorId id = motion_->motor;
  warn(id, installation_[id].name() + ": its program was not put in service: " + reason_of(*reply));
  motion_.reset();
  module.ends({});
}

// By the table of its group, or by this one.
void CamacMotors::move(std::int64_t now_us, Bushd2& module, const tables::TablePtr& by) {
  const MotorId id = motion_->motor;
  const motion::Motor& motor = installation_[id];
  if (motion_->to_stop || motor.has_plan()) {
    warn(id, motion_->to_stop ? motor.name() + ": stopped before it began"
                              : motion::busy_text(motor) + ", by another's request");
    motion_.reset();
    return module.ends({});
  }
  motion_->stage = Motion::Stage::kMoves;
  motion_->from_steps = motor.position_steps();
  const std::int64_t steps = motion_->program.steps;
  if (motion_->alone) {
    return program_.begin(
        now_us, installation_.mcu_of(motion_->motor),
        text_of(motion_->program, motor.name(), config_.without_computer, config_.f_start_hz),
        motion_->after_stops);
  }
  const std::vector<api::MotorAmount> motors{
      {motor.name(), motion_->program.left ? -steps : steps}};
  const api::Asker who = asker(motion_->after_stops);
  if (!by) return ask_(now_us, who, api::Move{.motors = motors});
  lines_.lend(who, by);
  ask_(now_us, who, api::MoveLine{.motors = motors});
}

std::optional<KeptMotion> CamacMotors::to_keep(const Bushd2& module) const {
  const bool goes = motion_ && motion_->alone && motion_->stage == Motion::Stage::kMoves;
  if (!goes || !config_.without_computer || !program_.runs()) return std::nullopt;
  const auto checksum = program_.checksum();
  if (!checksum) return std::nullopt;
  return KeptMotion{.control = module.control(),
                    .from_steps = motion_->from_steps,
                    .steps = motion_->program.steps,
                    .told = motion_->told,
                    .checksum = *checksum};
}

void CamacMotors::find(const KeptMotion& kept, Bushd2& module) {
  const std::size_t number = kept.control % Bushd2::kMotors;
  if (!config_.without_computer || number >= config_.motors.size()) return;
  module.goes_on(kept.control, kept.steps, kept.told);
  const MotorId motor = config_.motors[number];
  motion_ = Motion{.motor = motor,
                   .program = module.moving_program(),
                   .table = {},
                   .alone = true,
                   .stage = Motion::Stage::kMoves,
                   .from_steps = kept.from_steps,
                   .told = kept.told};
  program_.find(installation_.mcu_of(motor).id, kept.checksum);
}

// In the direction of its program.
std::int64_t CamacMotors::moved(const Motion& motion) const {
  const std::int64_t steps = installation_[motion.motor].position_steps() - motion.from_steps;
  return motion.program.left ? -steps : steps;
}

// All but the last one, which comes with the result.
void CamacMotors::tell_steps(Bushd2& module) {
  if (!installation_.mcu_of(motion_->motor).online()) return;
  const std::int64_t last = motion_->program.steps - 1;
  const auto made = static_cast<std::uint32_t>(std::clamp<std::int64_t>(
      moved(*motion_), motion_->told, std::max<std::int64_t>(last, motion_->told)));
  const std::uint32_t more = made - motion_->told;
  motion_->told = made;
  if (more > 0) module.answer(more, {});
}

void CamacMotors::follow_move(std::int64_t now_us, Bushd2& module) {
  const bool heard = !program_.is_found() || installation_[motion_->motor].is<motion::InProgram>();
  if (motion_->to_stop && !motion_->stopping && (!motion_->alone || heard)) {
    motion_->stopping = true;
    ask_to_stop(now_us, motion_->motor);
  }
  tell_steps(module);
  const std::optional<api::Reply> reply =
      motion_->alone ? program_.follow(now_us) : session_->last_answer();
  if (reply) end(module, *reply);
}

void CamacMotors::end(Bushd2& module, const api::Reply& reply) {
  const Motion ended = std::move(*motion_);
  motion_.reset();
  const auto outcome = outcome_of(reply);
  MotorStatus status = limits_of(installation_, ended.motor);
  if (outcome == api::Outcome::kReached) {
    return module.answer(ended.program.steps - ended.told, status);
  }
  if (outcome != api::Outcome::kStopped || !ended.stopping) {
    warn(ended.motor, api::reason_of(reply));
  }
  if (outcome == api::Outcome::kLimit) {
    (ended.program.left ? status.left_limit : status.right_limit) = true;
  } else if (outcome != api::Outcome::kStopped) {
    const bool supplied =
        (installation_.mcu_of(ended.motor).report().flags & BUSHD_FLAG_ENABLED) != 0;
    status.supply_missing = outcome.has_value() && !supplied;
    status.not_connected = outcome.has_value() && supplied;
  }
  const std::int64_t more = moved(ended) - ended.told;
  module.ends(status, static_cast<std::uint32_t>(std::max<std::int64_t>(more, 0)));
}

}  // namespace bushd::daemon
