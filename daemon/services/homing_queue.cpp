#include "daemon/services/homing_queue.h"

#include <algorithm>
#include <utility>

#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

using api::Outcome;

constexpr std::uint32_t kMoreSlowSteps = 1000;  // than a ramp has

struct Ending {
  Outcome outcome;
  std::string reason;
};

Ending ending_of(const bushd_report& report, const std::string& mcu) {
  switch (report.homing) {
    case BUSHD_HOMING_DONE:
      return {Outcome::kReached, "homed"};
    case BUSHD_HOMING_NOT_FOUND:
      return {Outcome::kFault,
              "its switch was not found within home.most_steps; check the switch and 'home'"};
    case BUSHD_HOMING_STUCK:
      return {Outcome::kFault,
              "its switch stayed active all the way back; is it stuck, or are "
              "home.slow_most_steps too few?"};
    case BUSHD_HOMING_LOST:
      return {Outcome::kFault,
              "its switch was not found again by the slow approach; check its contact"};
    default:
      break;
  }
  const unsigned stops =
      BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_OVERCURRENT;
  if (report.faults & stops) {
    return {Outcome::kStopped, "homing was ended because " + motion::stop_cause(report) +
                                   "; 'bushctl clear', then home it"};
  }
  if (report.faults & BUSHD_FAULT_LINK) {
    return {Outcome::kLink,
            "MCU " + mcu +
                " ended homing because it received nothing from the daemon; home the motor again"};
  }
  return {Outcome::kStopped, "homing was stopped on request"};
}

const char* remedy_of(unsigned refusal) {
  switch (refusal) {
    case BUSHD_E_FORBIDDEN:
      return "move it off that switch first";
    case BUSHD_E_STATE:
      return "home it when the motors of this MCU stand";
    default:
      return "check its 'home' and its table in the configuration";
  }
}

}  // namespace

HomingQueue::HomingQueue(Installation& installation, const Interlocks& interlocks,
                         OpenMoves& open_moves, KeptPositions& kept, Outputs& outputs)
    : installation_(installation),
      interlocks_(interlocks),
      open_(open_moves),
      kept_(kept),
      outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) queues_.add();
}

void HomingQueue::request(const api::Asker& asker, const api::Home& request) {
  const auto motors = motors_of(request);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  open_.open(asker, *motors, "home");
  for (const MotorId motor : *motors) add({motor, *floor_of(motor, request.speed)});
}

Result<std::vector<MotorId>> HomingQueue::motors_of(const api::Home& request) const {
  auto motors = installation_.find(request.motors);
  if (!motors) return motors;
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  for (const MotorId motor : *motors) {
    if (const auto may = may_home(motor); !may) {
      return fail(installation_[motor].name() + ": " + may.error().text());
    }
    if (const auto floor = floor_of(motor, request.speed); !floor) return fail(floor.error());
  }
  return motors;
}

Result<void> HomingQueue::may_home(MotorId id) const {
  const Mcu& mcu = installation_.mcu_of(id);
  if (!installation_.config()[id].home) {
    return fail("no home switch configured: add 'home = {...}' to motor \"" +
                installation_[id].name() + "\"");
  }
  if (installation_[id].has_plan()) return fail("it moves; stop it first");
  if (auto may = interlocks_.may_move(id); !may) return may;
  if (mcu.can_home()) return {};
  return fail("MCU " + mcu.name() +
              " cannot home; find out where it stands and run 'bushctl set NAME STEPS'");
}

Result<std::uint16_t> HomingQueue::floor_of(MotorId id,
                                            const std::optional<api::Speed>& speed) const {
  auto floor = installation_[id].floor_at(speed);
  if (!floor) return fail(installation_[id].name() + ": " + floor.error().message);
  return floor;
}

bushd_home HomingQueue::message_for(const Task& task) const {
  const MotorId id = task.motor;
  const config::Motor& motor = installation_.config()[id];
  const config::Home& home = *motor.home;
  const bushd_table& table = installation_.table_of(id)->view();
  const std::uint64_t first = std::max({table.accel.code[0], table.decel.code[0], task.floor});
  const std::uint64_t slow_ns = std::max<std::uint64_t>(
      {first * table.time_unit_ns, installation_.config().bus_of(motor).tick_ns(),
       1'000'000'000u / home.slow_steps_per_s});
  const std::uint64_t units = (slow_ns + BUSHD_HOME_UNIT_NS - 1) / BUSHD_HOME_UNIT_NS;
  return {.motor = motor.output.value,
          .direction = static_cast<std::int8_t>(home.positive ? 1 : -1),
          .most_steps = home.most_steps,
          .floor = task.floor,
          .slow_steps = home.slow_most_steps.value_or(table.decel.count + kMoreSlowSteps),
          .slow_delay = static_cast<std::uint16_t>(std::min<std::uint64_t>(units, UINT16_MAX)),
          .position_steps = home.position_steps};
}

bool HomingQueue::empty() const {
  return std::ranges::all_of(queues_, [](const Queue& queue) { return queue.tasks.empty(); });
}

void HomingQueue::add(const Task& task) {
  Mcu& mcu = installation_.mcu_of(task.motor);
  installation_[task.motor].home();
  queues_[mcu.id].tasks.push_back(task);
  if (queues_[mcu.id].tasks.size() == 1) begin(mcu);
  installation_.changed = true;
}

// With a store as soon as that knows of the motion: step().
void HomingQueue::begin(Mcu& mcu) {
  Queue& queue = queues_[mcu.id];
  queue.asked = !kept_.keeps();
  if (queue.asked) mcu.home(message_for(queue.tasks.front()));
}

void HomingQueue::step(std::int64_t now_us) {
  for (const McuId id : installation_.mcus()) {
    Queue& queue = queues_[id];
    if (queue.asked || queue.tasks.empty()) continue;
    const MotorId motor = queue.tasks.front().motor;
    const auto ready = kept_.make_ready(now_us, motor);
    if (ready && !*ready) continue;
    kept_.not_wanted(motor);
    if (!ready) {
      end(installation_[id], Outcome::kFault, ready.error().text());
    } else {
      queue.asked = true;
      installation_[id].home(message_for(queue.tasks.front()));
    }
  }
}

void HomingQueue::reports(std::int64_t, Mcu& mcu) {
  const Queue& queue = queues_[mcu.id];
  if (queue.tasks.empty() || !queue.asked || mcu.busy()) return;
  const unsigned output = installation_[queue.tasks.front().motor].output().value;
  if (((mcu.report().autonomous | mcu.report().moving) >> output & 1) != 0) return;
  const Ending ending = ending_of(mcu.report(), mcu.name());
  end(mcu, ending.outcome, ending.reason);
}

void HomingQueue::end(Mcu& mcu, Outcome outcome, const std::string& reason) {
  Queue& queue = queues_[mcu.id];
  const MotorId id = queue.tasks.front().motor;
  queue.tasks.pop_front();
  motion::Motor& motor = installation_[id];
  motor.end_homing(outcome == Outcome::kReached);
  outputs_.log(outcome == Outcome::kReached ? LogLevel::kInfo : LogLevel::kWarning,
               motor.name() + ": " + reason);
  open_.end(id, outcome, reason);
  if (!queue.tasks.empty()) begin(mcu);
}

void HomingQueue::goes_offline(Mcu& mcu, const std::string& cause) {
  for (const auto& [motor, floor] : std::exchange(queues_[mcu.id], {}).tasks) {
    kept_.not_wanted(motor);
    installation_[motor].end_homing(false);
    open_.end(motor, Outcome::kLink, cause + "; it was being homed");
  }
}

void HomingQueue::refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) {
  if (type != BUSHD_MSG_HOME || queues_[mcu.id].tasks.empty()) return;
  end(mcu, Outcome::kFault,
      "MCU " + mcu.name() + " refused to home it: " + bushd_status_text(status) + "; " +
          remedy_of(status));
}

bool HomingQueue::end_if_waiting(MotorId motor) {
  Queue& queue = queues_[installation_.config()[motor].mcu];
  const auto is_motor = [motor](const Task& task) { return task.motor == motor; };
  const bool first = !queue.tasks.empty() && is_motor(queue.tasks.front());
  if ((first && queue.asked) || std::erase_if(queue.tasks, is_motor) == 0) return false;
  kept_.not_wanted(motor);
  if (first && !queue.tasks.empty()) begin(installation_.mcu_of(motor));
  installation_[motor].end_homing(false);
  open_.end(motor, Outcome::kStopped, "stopped before it was its turn to be homed");
  return true;
}

void HomingQueue::end_waiting() {
  for (const MotorId motor : installation_.motors()) end_if_waiting(motor);
}

void HomingQueue::stop(MotorId motor) {
  if (!installation_[motor].is<motion::Homing>() || end_if_waiting(motor)) return;
  bushd_home give_up = message_for({motor, 0});
  give_up.most_steps = 0;
  installation_.mcu_of(motor).home(give_up);
}

// Those that shall be homed whenever their MCU comes and has not homed them.
void HomingQueue::goes_online(Mcu& mcu) {
  for (const MotorId id : mcu.motors()) {
    const auto& home = installation_.config()[id].home;
    const motion::Motor& motor = installation_[id];
    const bool homed = (mcu.report().homed >> motor.output().value & 1) != 0;
    if (!home || !home->at_start || (homed && !motor.uncertain_reason())) continue;
    const auto floor = motor.floor_at({});
    if (const auto may = floor ? may_home(id) : fail(floor.error()); !may) {
      outputs_.log(LogLevel::kWarning, motor.name() + " is not homed: " + may.error().text());
      continue;
    }
    add({id, *floor});
  }
}

}  // namespace bushd::daemon
