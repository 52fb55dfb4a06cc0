#include "daemon/services/local_inputs.h"

#include "base/output_bits.h"

namespace bushd::daemon {

LocalInputs::LocalInputs(Installation& installation) : installation_(installation) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) tasks_.add();
}

bool LocalInputs::may_move(MotorId id) const {
  return installation_.mcu_of(id).online() && installation_.drives()[id].moved_by_people();
}

bool LocalInputs::move(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  return may_move(id) && motor.is<motion::Local>() &&
         has_bit(installation_.mcu_of(id).report().autonomous, motor.output());
}

void LocalInputs::stop(MotorId id) {
  Mcu& mcu = installation_.mcu_of(id);
  tasks_[mcu.id].stopping |= bit_of(installation_[id].output());
  tasks_[mcu.id].refused.reset();
  follow(mcu);
}

bool LocalInputs::is_stopping(MotorId id) const {
  return has_bit(tasks_[installation_.mcu_of(id).id].stopping, installation_[id].output());
}

bool LocalInputs::has_told(MotorId id) const {
  const motion::Motor& motor = installation_[id];
  const Mcu& mcu = installation_.mcu_of(id);
  const bool told = has_bit(tasks_[mcu.id].inhibited, motor.output());
  if (!installation_.drives()[id].moved_by_people() || !mcu.online()) return true;
  return !motor.hold().is_set() || refusal(id) || (told && !mcu.busy());
}

std::optional<std::string> LocalInputs::refusal(MotorId id) const {
  const Mcu& mcu = installation_.mcu_of(id);
  const auto& refused = tasks_[mcu.id].refused;
  if (!refused) return std::nullopt;
  return "MCU " + mcu.name() +
         " refused to take it from its local inputs: " + bushd_status_text(*refused) +
         "; release them, or run 'bushctl estop'";
}

std::uint16_t LocalInputs::held(const Mcu& mcu) const {
  if (!installation_.any_moved_by_people()) return 0;
  unsigned held = 0;
  for (const MotorId id : mcu.motors()) {
    const bool theirs = installation_.drives()[id].moved_by_people();
    if (theirs && installation_[id].hold().is_set()) held |= bit_of(installation_[id].output());
  }
  return static_cast<std::uint16_t>(held);
}

void LocalInputs::tell(Mcu& mcu, std::uint16_t inhibited) {
  Task& task = tasks_[mcu.id];
  task.before = task.inhibited;
  task.inhibited = inhibited;
  if (mcu.offers.local_inputs != nullptr) {
    mcu.offers.local_inputs->inhibit_local(mcu.on_bus(), inhibited);
  }
}

// What came before the MCU took the message says nothing.
void LocalInputs::reports(std::int64_t, Mcu& mcu) {
  Task& task = tasks_[mcu.id];
  const unsigned moving = mcu.report().moving | mcu.report().autonomous;
  if (mcu.busy() || (task.stopping & task.inhibited & ~moving) == 0) return;
  task.stopping &= static_cast<std::uint16_t>(moving | ~task.inhibited);
  installation_.changed = true;
}

// A motor gets back to people when it rests: while it moves its MCU would refuse that.
void LocalInputs::follow(Mcu& mcu) {
  Task& task = tasks_[mcu.id];
  if (!mcu.online()) {
    // It does not get them with its configuration.
    const unsigned more = held(mcu) & ~unsigned{task.inhibited};
    if (more != 0) tell(mcu, static_cast<std::uint16_t>(task.inhibited | more));
    return;
  }
  const unsigned moving = mcu.report().moving | mcu.report().autonomous;
  const unsigned wanted = held(mcu) | task.stopping;
  const unsigned more = wanted & ~task.inhibited & ~(task.refused ? moving : 0u);
  const unsigned less = task.inhibited & ~wanted & ~moving;
  if (more != 0) {
    tell(mcu, static_cast<std::uint16_t>(task.inhibited | more));
  } else if (less != 0 && !mcu.busy()) {
    tell(mcu, static_cast<std::uint16_t>(task.inhibited & ~less));
  }
}

void LocalInputs::step(std::int64_t) {
  for (const McuId id : installation_.mcus()) follow(installation_[id]);
}

void LocalInputs::refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) {
  if (type != BUSHD_MSG_LOCAL) return;
  Task& task = tasks_[mcu.id];
  task.refused = status;
  task.inhibited = task.before;
  task.stopping = 0;
  installation_.changed = true;
}

// It was configured with what it was told last.
void LocalInputs::goes_online(Mcu& mcu) {
  tasks_[mcu.id].refused.reset();
}

void LocalInputs::goes_offline(Mcu& mcu, const std::string&) {
  tasks_[mcu.id].stopping = 0;
}

}  // namespace bushd::daemon
