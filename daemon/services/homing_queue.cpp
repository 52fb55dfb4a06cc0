#include "daemon/services/homing_queue.h"

#include <algorithm>
#include <utility>

#include "base/output_bits.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

using api::Outcome;

constexpr const char* kNotItsTurn = "stopped before it was its turn to be homed";

struct HomingEnd {
  Outcome outcome;
  std::string reason;
};

HomingEnd end_of_homing(const bushd_report& report, const std::string& mcu) {
  switch (report.homing) {
    case BUSHD_HOMING_DONE:
      return {Outcome::kReached, "homed"};
    case BUSHD_HOMING_NOT_FOUND:
      return {Outcome::kFault,
              "its switch was not found within home.most_steps, or up to its limits; check the "
              "switch and 'home'"};
    case BUSHD_HOMING_LIMIT:
      return {Outcome::kFault,
              "it came to a limit switch while it looked slowly for the edge of its home switch; "
              "move one of the two switches"};
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
  const unsigned stops = BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT |
                         BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED;
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
                         OpenMoves& open_moves, Moves& moves, KeptPositions& kept,
                         IdleDrivers& idle_drivers, Outputs& outputs)
    : installation_(installation),
      interlocks_(interlocks),
      open_(open_moves),
      moves_(moves),
      kept_(kept),
      idle_drivers_(idle_drivers),
      outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) queues_.add();
}

void HomingQueue::request(const api::Asker& asker, const api::Home& request) {
  const auto motors = motors_of(request);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  asker.answer(api::Accepted{});
  open_.open(asker, *motors, OpenMoves::Purpose::kHome);
  if (request.all) sequence_.emplace();
  for (const MotorId motor : *motors) {
    Task task{.motor = motor,
              .shortest_delay = *shortest_delay_of(motor, request.speed),
              .after_stops = asker.after_stops};
    if (!request.all) {
      add(std::move(task));
    } else {
      installation_[motor].give_to_mcu(motion::Homing{});
      sequence_->later.push_back(std::move(task));
    }
  }
  if (request.all) begin_next_of_sequence();
}

bool HomingQueue::empty() const {
  return !sequence_ && std::ranges::all_of(queues_, &Queue::empty);
}

void HomingQueue::add(Task task) {
  Mcu& mcu = installation_.mcu_of(task.motor);
  installation_[task.motor].give_to_mcu(motion::Homing{});
  queues_[mcu.id].push_back(std::move(task));
  if (queues_[mcu.id].size() == 1) begin(mcu);
  installation_.changed = true;
}

// With a store as soon as that knows of the motion, and once its drivers are enabled: step(). There
// one ends as well that may not begin any more.
void HomingQueue::begin(Mcu& mcu) {
  if (queues_[mcu.id].empty()) return;
  Task& task = queues_[mcu.id].front();
  if (task.phase != Phase::kWaiting) return;  // it has begun as the next of a sequence
  const bool ends = !may_begin(task.motor) || !task.ended_by.empty();
  if (kept_.keeps() || !idle_drivers_.none() || ends) return;
  task.phase = Phase::kHoming;
  mcu.offers.homing->home(mcu.on_bus(), message_for(task));
}

// Now that it is its turn.
Result<void> HomingQueue::may_begin(MotorId id) const {
  if (const motion::Motor& motor = installation_[id]; motor.hold().is_set()) {
    return fail("it was held before it was its turn to be homed, " + *motor.hold().how());
  }
  if (auto may = interlocks_.may_begin(id); !may)
    return fail("not homed, because " + may.error().text());
  return {};
}

void HomingQueue::step(std::int64_t now_us) {
  for (const McuId id : installation_.mcus()) {
    if (!queues_[id].empty()) step(now_us, installation_[id]);
  }
}

void HomingQueue::step(std::int64_t now_us, Mcu& mcu) {
  switch (queues_[mcu.id].front().phase) {
    case Phase::kWaiting:
      return ask(now_us, mcu);
    case Phase::kHoming:
      return;
    case Phase::kFound:
      return move_on(now_us, mcu);
    case Phase::kMovingOn:
      return follow_moving_on(mcu);
  }
}

void HomingQueue::ask(std::int64_t now_us, Mcu& mcu) {
  Task& task = queues_[mcu.id].front();
  if (const auto may = may_begin(task.motor); !may) {
    return end(mcu, Outcome::kStopped, may.error().text());
  }
  if (!task.ended_by.empty()) return end(mcu, Outcome::kStopped, std::string(task.ended_by));
  const auto ready = kept_.make_ready(now_us, task.motor);
  const bool powered = idle_drivers_.make_ready(now_us, mcu.id);
  if (ready && !(*ready && powered)) return;
  kept_.not_wanted(task.motor);
  if (!ready) return end(mcu, Outcome::kFault, ready.error().text());
  task.phase = Phase::kHoming;
  mcu.offers.homing->home(mcu.on_bus(), message_for(task));
}

void HomingQueue::reports(std::int64_t, Mcu& mcu) {
  const Queue& queue = queues_[mcu.id];
  if (queue.empty() || queue.front().phase != Phase::kHoming || mcu.busy()) return;
  const Task& task = queue.front();
  const unsigned moved = mcu.report().autonomous | mcu.report().moving;
  if (has_bit(moved, installation_[task.motor].output())) return;
  HomingEnd ending = end_of_homing(mcu.report(), mcu.name());
  if (ending.outcome == Outcome::kReached) return found(mcu);
  if (ending.outcome == Outcome::kStopped && !task.ended_by.empty()) ending.reason = task.ended_by;
  end(mcu, ending.outcome, ending.reason);
}

void HomingQueue::found(Mcu& mcu) {
  Task& task = queues_[mcu.id].front();
  if (!installation_.config()[task.motor].home->then || !task.ended_by.empty()) {
    return end(mcu, Outcome::kReached, "homed");
  }
  // A pause lets homing go on; what comes after it is another motion.
  if (const auto by = open_.precedence().overtaken(task.after_stops, {task.motor})) {
    return end(mcu, Outcome::kReached, "homed; it does not move on, stopped by " + by->by);
  }
  outputs_.log(LogLevel::kInfo, task.motor, installation_[task.motor].name() + ": homed; moves on");
  task.phase = Phase::kFound;
}

// Nobody else has a motor that is being homed, up to the moment at which it moves.
void HomingQueue::move_on(std::int64_t now_us, Mcu& mcu) {
  Task& task = queues_[mcu.id].front();
  const auto ready = kept_.make_ready(now_us, task.motor);
  if (ready && !*ready) return;
  kept_.not_wanted(task.motor);
  constexpr const char* kStays = "homed, but it does not move on: ";
  release(task.motor, true);
  if (!ready) return end(mcu, Outcome::kFault, kStays + ready.error().text());
  task.phase = Phase::kMovingOn;
  const double then = *installation_.config()[task.motor].home->then;
  const auto target = moves_.go_on(now_us, task.motor, api::UserUnits{then});
  if (!target) return end(mcu, Outcome::kFault, kStays + target.error().text());
  task.then_steps = *target;
}

// Its part of the request has ended with that move.
void HomingQueue::follow_moving_on(Mcu& mcu) {
  const Task task = queues_[mcu.id].front();
  const motion::Motor& motor = installation_[task.motor];
  if (motor.has_plan() && (motor.stops() || motor.target_steps() == task.then_steps)) {
    return;
  }
  const bool reached = !motor.has_plan() && motor.position_steps() == task.then_steps;
  queues_[mcu.id].pop_front();
  follow_sequence(
      task.motor, reached,
      "it was homed, and did not reach " + motor.scale().coordinates().text(task.then_steps));
  begin(mcu);
}

void HomingQueue::end(Mcu& mcu, Outcome outcome, const std::string& reason) {
  const MotorId id = queues_[mcu.id].front().motor;
  queues_[mcu.id].pop_front();
  outputs_.log(outcome == Outcome::kReached ? LogLevel::kInfo : LogLevel::kWarning, id,
               installation_[id].name() + ": " + reason);
  ended(id, outcome, reason);
  begin(mcu);
}

void HomingQueue::release(MotorId id, bool found) {
  motion::Motor& motor = installation_[id];
  if (found && motor.is<motion::Homing>()) motor.trust().is_known();
  motor.take_from_mcu(motion::Homing{});
}

void HomingQueue::ended(MotorId id, Outcome outcome, const std::string& reason) {
  kept_.not_wanted(id);
  release(id, outcome == Outcome::kReached);
  open_.end(id, outcome, reason);
  follow_sequence(id, outcome == Outcome::kReached, reason);
}

// One that is not found ends the others.
void HomingQueue::follow_sequence(MotorId id, bool good, const std::string& reason) {
  if (!sequence_) return;
  const auto is_motor = [id](const Task& task) { return task.motor == id; };
  if (std::erase(sequence_->now, id) == 0 && std::erase_if(sequence_->later, is_motor) == 0) return;
  if (good) {
    if (sequence_->now.empty()) begin_next_of_sequence();
    return;
  }
  const std::string because = "ended, because " + installation_[id].name() + ": " + reason;
  const Sequence rest = *std::exchange(sequence_, std::nullopt);
  for (const Task& task : rest.later) ended(task.motor, Outcome::kStopped, because);
  for (const MotorId other : rest.now) {
    if (end_if_waiting(other, because)) continue;
    for (Task& task : queues_[installation_.config()[other].mcu]) {
      if (task.motor == other && task.phase == Phase::kHoming) give_up(task, because);
    }
  }
}

void HomingQueue::begin_next_of_sequence() {
  if (sequence_->later.empty()) return sequence_.reset();
  const auto order_of = [this](const Task& task) {
    return installation_.config()[task.motor].home->order;
  };
  const std::int32_t order = order_of(sequence_->later.front());
  std::vector<Task> tasks;
  while (!sequence_->later.empty() && order_of(sequence_->later.front()) == order) {
    tasks.push_back(std::move(sequence_->later.front()));
    sequence_->later.pop_front();
    sequence_->now.push_back(tasks.back().motor);
  }
  for (Task& task : tasks) add(std::move(task));
}

void HomingQueue::goes_offline(Mcu& mcu, const std::string& cause) {
  const std::string reason = cause + "; it was being homed";
  for (const Task& task : std::exchange(queues_[mcu.id], {})) {
    ended(task.motor, Outcome::kLink, reason);
  }
  if (!sequence_) return;
  const auto later = std::ranges::find_if(sequence_->later, [&](const Task& task) {
    return installation_.config()[task.motor].mcu == mcu.id;
  });
  if (later != sequence_->later.end()) ended(later->motor, Outcome::kLink, reason);
}

void HomingQueue::refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) {
  if (type != BUSHD_MSG_HOME || queues_[mcu.id].empty()) return;
  if (queues_[mcu.id].front().phase != Phase::kHoming) return;
  end(mcu, Outcome::kFault,
      "MCU " + mcu.name() + " refused to home it: " + bushd_status_text(status) + "; " +
          remedy_of(status));
}

bool HomingQueue::end_if_waiting(MotorId id, const std::string& because) {
  Queue& queue = queues_[installation_.config()[id].mcu];
  const auto task = std::ranges::find(queue, id, &Task::motor);
  const bool later =
      sequence_ && std::ranges::find(sequence_->later, id, &Task::motor) != sequence_->later.end();
  if (later) {
    ended(id, Outcome::kStopped, because);
    return true;
  }
  if (task == queue.end()) return false;
  if (task->phase == Phase::kFound) {
    release(id, true);
    end(installation_.mcu_of(id), Outcome::kStopped,
        "homed; " + (because == kNotItsTurn ? "stopped before it moved on" : because));
    return true;
  }
  if (task->phase != Phase::kWaiting) return false;
  const bool first = task == queue.begin();
  queue.erase(task);
  ended(id, Outcome::kStopped, because);
  if (first) begin(installation_.mcu_of(id));
  return true;
}

HomingQueue::Task* HomingQueue::task_of(MotorId id) {
  const auto in = [id](std::deque<Task>& tasks) -> Task* {
    const auto found = std::ranges::find(tasks, id, &Task::motor);
    return found != tasks.end() ? &*found : nullptr;
  };
  Task* task = in(queues_[installation_.config()[id].mcu]);
  return task == nullptr && sequence_ ? in(sequence_->later) : task;
}

bool HomingQueue::is_of_sequence(MotorId id) const {
  if (!sequence_) return false;
  return std::ranges::find(sequence_->now, id) != sequence_->now.end() ||
         std::ranges::find(sequence_->later, id, &Task::motor) != sequence_->later.end();
}

// Motors that are being homed go on if only others of all are paused or held: those end when it is
// their turn.
void HomingQueue::end_overtaken(std::int64_t) {
  for (const MotorId id : installation_.motors()) {
    if (!installation_[id].is<motion::Homing>()) continue;
    Task* task = task_of(id);
    if (task == nullptr || task->phase == Phase::kHoming) continue;
    const auto by = open_.precedence().overtaken(task->after_stops, {id});
    if (!by) continue;
    open_.stopped_by({id}, by->by);
    if (task->phase == Phase::kWaiting && is_of_sequence(id)) {
      task->ended_by = kNotItsTurn;
    } else {
      end_if_waiting(id, kNotItsTurn);
    }
  }
}

void HomingQueue::end_waiting() {
  for (const MotorId motor : installation_.motors()) {
    end_if_waiting(motor, kNotItsTurn);
  }
}

void HomingQueue::give_up(Task& task, const std::string& because) {
  if (!task.ended_by.empty()) return;
  task.ended_by = because;
  bushd_home message = message_for({.motor = task.motor, .shortest_delay = 0});
  message.most_steps = 0;
  const Mcu& mcu = installation_.mcu_of(task.motor);
  mcu.offers.homing->home(mcu.on_bus(), message);
}

void HomingQueue::stop(MotorId id) {
  if (!installation_[id].is<motion::Homing>()) return;
  if (end_if_waiting(id, kNotItsTurn)) return;
  for (Task& task : queues_[installation_.config()[id].mcu]) {
    if (task.motor == id) give_up(task, "homing was stopped on request");
  }
}

// Those that shall be homed whenever their MCU comes and has not homed them.
void HomingQueue::goes_online(Mcu& mcu) {
  for (const MotorId id : mcu.motors()) {
    const auto& home = installation_.config()[id].home;
    const motion::Motor& motor = installation_[id];
    const bool homed = has_bit(mcu.report().homed, motor.output());
    const bool at_start = home && (home->at_start || mcu.config.ready_after_homing);
    if (!at_start || (homed && !motor.trust().uncertain_reason())) continue;
    const auto shortest_delay = shortest_delay_of(id, {});
    auto may = shortest_delay ? may_home(id) : fail(shortest_delay.error());
    if (may) may = may_home_by(id, *shortest_delay);
    if (!may) {
      outputs_.log(LogLevel::kWarning, id, motor.name() + " is not homed: " + may.error().text());
      continue;
    }
    add({.motor = id,
         .shortest_delay = *shortest_delay,
         .after_stops = open_.precedence().stops()});
  }
}

}  // namespace bushd::daemon
