#include "daemon/services/state_publisher.h"

#include <algorithm>
#include <string>
#include <utility>

#include "daemon/model/table_ref.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

bool same_positions(const bushd_report& a, const bushd_report& b) {
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (a.motor[m].position_steps != b.motor[m].position_steps) return false;
  }
  return true;
}

// All that a snapshot tells of a report besides positions. Times, SYNCs and counters go on.
bool tell_the_same(const bushd_report& a, const bushd_report& b) {
  return a.state == b.state && a.faults == b.faults && a.flags == b.flags &&
         a.boot_number == b.boot_number && a.moving == b.moving && a.inputs == b.inputs &&
         a.forbidden_positive == b.forbidden_positive &&
         a.forbidden_negative == b.forbidden_negative && a.system_inputs == b.system_inputs &&
         a.autonomous == b.autonomous && a.homed == b.homed && a.armed == b.armed;
}

api::McuState state_word(const link::McuView& view) {
  if (view.phase == link::McuPhase::kOffline) return api::McuState::kOffline;
  if (view.phase == link::McuPhase::kConnecting || view.outdated_us > 0)
    return api::McuState::kBusy;
  switch (view.report.state) {
    case BUSHD_STATE_READY:
      return api::McuState::kReady;
    case BUSHD_STATE_RUN:
      return api::McuState::kRunning;
    case BUSHD_STATE_FAULT:
      return api::McuState::kFault;
    default:
      return api::McuState::kBusy;
  }
}

api::StopMode stop_mode_of(const config::Bus& bus) {
  switch (bus.emergency_stop) {
    case BUSHD_STOP_IMMEDIATE:
      return api::StopMode::kImmediate;
    case BUSHD_STOP_DISABLE:
      return api::StopMode::kDisable;
    default:
      return api::StopMode::kRamp;
  }
}

std::string detail_of(const Mcu& mcu, bool two_masters) {
  const link::McuView& view = mcu.view();
  if (view.phase != link::McuPhase::kOnline && view.bound_by_stop) {
    return view.detail + "; an emergency stop binds it: when it is there, run 'bushctl clear'";
  }
  if (view.phase != link::McuPhase::kOnline) return view.detail;
  if (view.outdated_us > 0) return "has not reported since this daemon stood still";
  if (view.report.faults != 0) return motion::fault_text(view.report);
  if (two_masters) return "another master talks on the bus";
  if ((view.report.flags & BUSHD_FLAG_ENABLED) == 0) {
    return mcu.asleep ? "drivers disabled at rest" : "drivers disabled";
  }
  return view.note;
}

api::Activity activity_of(const motion::Motor& motor) {
  if (motor.moves() || motor.is<motion::Travelling>() || motor.is<motion::InProgram>()) {
    return api::Activity::kMoving;
  }
  if (const auto* armed = motor.as<motion::Armed>()) {
    return armed->confirmed ? api::Activity::kArmed : api::Activity::kArming;
  }
  if (motor.is<motion::Homing>()) return api::Activity::kHoming;
  return motor.is<motion::Local>() ? api::Activity::kLocal : api::Activity::kResting;
}

double velocity_of(const motion::Motor& motor) {
  return motor.moves() && !motion::is_late(motor) ? motor.axis().velocity_steps_per_s() : 0.0;
}

api::MotorState::Line line_of(const Mcu& mcu, const motion::Axis& axis) {
  const double made = axis.line_step();
  const motion::Tick left = std::max<motion::Tick>(axis.over_tick() - mcu.view().tick, 0);
  return {.fraction = made / std::max(axis.line()->longest, 1u),
          .left_us = left * axis.tick_ns() / 1000};
}

void show_inputs(const link::McuView& view, const config::MotorInputs& inputs,
                 api::MotorState& state) {
  const auto is_active = [&view](const std::optional<config::Input>& input) {
    return input && view.reported && (view.report.inputs >> input->number & 1) != 0;
  };
  state.input = is_active(inputs.positive) || is_active(inputs.negative) ||
                is_active(inputs.home) || is_active(inputs.own);
  const auto tell = [&](const char* word, const std::optional<config::Input>& input) {
    if (!is_active(input)) return;
    if (!state.inputs.empty()) state.inputs += ' ';
    state.inputs += word;
  };
  tell("positive", inputs.positive);
  tell("negative", inputs.negative);
  tell("home", inputs.home);
  tell("step", inputs.step);
}

}  // namespace

StatePublisher::StatePublisher(Installation& installation, const PseudoAxes& pseudo_axes,
                               const OpenMoves& open_moves, ProgramOf program_of, Outputs& outputs,
                               std::size_t most_in_motion)
    : installation_(installation),
      pseudo_axes_(pseudo_axes),
      open_moves_(open_moves),
      program_of_(std::move(program_of)),
      outputs_(outputs),
      most_in_motion_(most_in_motion) {
  for (std::size_t i = 0; i < installation.config().state_parts(); ++i) described_.add();
  for ([[maybe_unused]] const McuId id : installation.mcus()) told_.add();
}

void StatePublisher::step(std::int64_t now_us) {
  if (installation_.changed) due_us_ = std::min(due_us_, next_wake_us());
  if (now_us >= due_us_) publish_due(now_us);
}

void StatePublisher::publish_all(std::int64_t now_us) {
  anew_ = true;
  publish_due(now_us);
}

void StatePublisher::publish_due(std::int64_t now_us) {
  anew_ |= installation_.changed;
  moving_.clear();
  for (const McuId id : installation_.mcus()) {
    const Mcu& mcu = installation_[id];
    if (!installation_.rests(mcu)) {
      moving_.push_back(id);
    } else if (anew_ || !is_as_told(now_us, mcu)) {
      publish(now_us, id);
    }
  }
  publish_moving(now_us);
  publish_axes(now_us);
  installation_.changed = anew_ = false;
  sent_us_ = now_us;
  due_us_ = now_us + kPeriodUs - kReportJitterUs;
}

void StatePublisher::publish_moving(std::int64_t now_us) {
  const bool all = anew_ || moving_.size() <= most_in_motion_;
  std::erase_if(moving_, [&](McuId id) {
    const link::McuView& view = installation_[id].view();
    const Told& told = told_[id];
    const bool at_once = all || !tell_the_same(view.report, told.report) || view.note != told.note;
    if (at_once) publish(now_us, id);
    return at_once;
  });
  if (moving_.empty()) return;
  const auto from = std::ranges::lower_bound(moving_, first_moving_);
  std::ranges::rotate(moving_, from == moving_.end() ? moving_.begin() : from);
  const std::size_t count = std::min(most_in_motion_, moving_.size());
  for (std::size_t i = 0; i < count; ++i) publish(now_us, moving_[i]);
  first_moving_ = moving_[count % moving_.size()];
}

// A snapshot is long, and most MCUs rest. Precondition: this one does.
bool StatePublisher::is_as_told(std::int64_t now_us, const Mcu& mcu) const {
  const Told& told = told_[mcu.id];
  const link::McuView& view = mcu.view();
  return now_us < told.due_us && mcu.online() && view.outdated_us == 0 &&
         tell_the_same(view.report, told.report) && same_positions(view.report, told.report) &&
         view.note == told.note && program_of_(mcu.id).empty();
}

void StatePublisher::publish(std::int64_t now_us, McuId id) {
  const Mcu& mcu = installation_[id];
  if (describes(now_us, id)) publish(now_us, id, description_of(mcu));
  outputs_.publish(id, state_of(mcu));
  told_[id] = {
      .due_us = now_us + kRestingPeriodUs, .report = mcu.view().report, .note = mcu.view().note};
}

void StatePublisher::publish_axes(std::int64_t now_us) {
  const auto of_motor = [this](MotorId motor) {
    return state_of(installation_.mcu_of(motor), installation_[motor]);
  };
  for (std::size_t i = 0; i < pseudo_axes_.size(); ++i) {
    const McuId part{installation_.config().mcus.size() + i};
    if (describes(now_us, part)) publish(now_us, part, pseudo_axes_.description(i));
    outputs_.publish(part, pseudo_axes_.state(i, of_motor));
  }
}

std::int64_t StatePublisher::next_wake_us() const {
  if (installation_.changed) return std::min(due_us_, sent_us_ + kMinPeriodUs);
  return due_us_ + kSlackUs;
}

// A description changes with what is marked as changed, and is long.
bool StatePublisher::describes(std::int64_t now_us, McuId part) const {
  return installation_.changed || now_us >= described_[part].due_us;
}

void StatePublisher::publish(std::int64_t now_us, McuId part, api::Description description) {
  Described& described = described_[part];
  if (now_us < described.due_us && description == described.last) return;
  outputs_.publish(part, description);
  described = {.last = std::move(description), .due_us = now_us + kDescriptionPeriodUs};
}

api::MotorState StatePublisher::state_of(const Mcu& mcu, const motion::Motor& motor) const {
  const link::McuView& view = mcu.view();
  const unsigned output = motor.output().value;
  const auto reports = [&view, output](unsigned mask) {
    return view.reported && (mask >> output & 1) != 0;
  };
  api::MotorState state;
  state.name = motor.name();
  state.position_steps = motor.position_steps();
  state.user = motor.scale().coordinates().user_of(motor.position_steps());
  state.dial = motor.scale().coordinates().dial_of(motor.position_steps());
  state.target_steps = motor.target_steps();
  state.user_target = motor.scale().coordinates().user_of(motor.target_steps());
  state.velocity_steps_per_s = velocity_of(motor);
  state.activity = activity_of(motor);
  if (motor.is<motion::OnLine>()) state.line = line_of(mcu, motor.axis());
  // Motors follow reports only once their MCU is online; and one that another master moves may not
  // have made its first step.
  const bool by_other = installation_.bus_of(mcu).two_masters && reports(view.report.moving);
  if (state.activity == api::Activity::kResting && by_other) state.activity = api::Activity::kLocal;
  if (view.phase == link::McuPhase::kConnecting && reports(view.report.autonomous)) {
    state.activity = api::Activity::kLocal;
  }
  state.moving = state.activity != api::Activity::kResting && !motor.is<motion::Armed>();
  state.enabled = view.reported && (view.report.flags & BUSHD_FLAG_ENABLED) != 0;
  show_inputs(view, installation_.config()[*mcu.motor_at(motor.output())].inputs, state);
  state.inhibited = {.positive = reports(view.report.forbidden_positive),
                     .negative = reports(view.report.forbidden_negative)};
  std::optional<std::uint16_t> boot_number;
  if (view.identified) boot_number = view.identity.boot_number;
  motion::PositionTrust trust = motion::position_trust(motor, boot_number);
  const bool good = trust.trust == api::Trust::kKnown || trust.trust == api::Trust::kRestored;
  if (good && view.outdated_us > 0) {
    trust = {api::Trust::kStale,
             "MCU " + mcu.name() + " has not reported since this daemon stood still",
             outputs_.wall_clock_us() - view.outdated_us};
  }
  if (trust.trust == api::Trust::kUnknown) state.position_steps = state.target_steps = 0;
  state.trust = trust.trust;
  state.uncertain_reason = std::move(trust.reason);
  state.heard_utime_us = trust.heard_utime_us;
  state.paused = motor.is_paused();
  state.held = motor.hold().is_set();
  const api::Asker* asker = open_moves_.asker_of(*mcu.motor_at(motor.output()));
  if (motor.is<motion::Armed>() && asker != nullptr) state.armed_by = text_of(*asker);
  return state;
}

api::StateSnapshot StatePublisher::state_of(const Mcu& mcu) const {
  const link::McuView& view = mcu.view();
  const Bus& bus = installation_.bus_of(mcu);
  api::StateSnapshot state;
  state.bus = bus.config.name;
  state.mcu = mcu.name();
  state.state = state_word(view);
  state.detail = detail_of(mcu, bus.two_masters);
  const bool is_good =
      state.state == api::McuState::kReady || state.state == api::McuState::kRunning;
  if (const auto left = installation_.to_be_homed(mcu); is_good && !left.empty()) {
    state.state = api::McuState::kBusy;
    state.detail = "not homed yet:";
    for (const MotorId motor : left) state.detail += " " + installation_[motor].name();
  }
  if (view.reported) state.inputs = motion::system_inputs_words(view.report.system_inputs);
  state.program = program_of_(mcu.id);
  state.boot = view.identified ? view.identity.boot_number : 0;
  state.tick = view.tick;
  state.motors.reserve(mcu.motors().size());
  for (const MotorId motor : mcu.motors()) {
    state.motors.push_back(state_of(mcu, installation_[motor]));
  }
  return state;
}

api::Description StatePublisher::description_of(const Mcu& mcu) const {
  const Bus& its_bus = installation_.bus_of(mcu);
  const config::Bus& bus = its_bus.config;
  api::Description description{.bus = bus.name,
                               .mcu = mcu.name(),
                               .address = mcu.config.address.value,
                               .tick_ns = bus.tick_ns(),
                               .emergency_stop = stop_mode_of(bus),
                               .port = its_bus.port,
                               .motors = {}};
  for (const MotorId motor : mcu.motors()) {
    const config::Motor& config = installation_.config()[motor];
    const units::Coordinates& coordinates = installation_[motor].scale().coordinates();
    units::Scale scale = coordinates.scale();
    scale.decimals = coordinates.precision();
    description.motors.push_back({.name = config.name,
                                  .output = config.output.value,
                                  .group = installation_.config().group_of(config).name,
                                  .table = ref_to(*installation_.table_of(motor)),
                                  .text = config.description,
                                  .scale = std::move(scale),
                                  .soft_limits = installation_[motor].scale().soft_limits()});
  }
  return description;
}

}  // namespace bushd::daemon
