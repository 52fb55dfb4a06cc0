#include "daemon/services/idle_drivers.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bushd::daemon {
namespace {

std::int64_t idle_us(const Mcu& mcu) {
  return std::llround(mcu.config.idle_disable_s.value_or(0) * 1e6);
}

std::int64_t settle_us(const Mcu& mcu) {
  return std::int64_t{mcu.config.enable_settle_ms} * 1000;
}

bool enabled(const Mcu& mcu) {
  return mcu.online() && (mcu.report().flags & BUSHD_FLAG_ENABLED) != 0;
}

}  // namespace

IdleDrivers::IdleDrivers(Installation& installation, Outputs& outputs,
                         std::function<bool(MotorId)> about_to_move)
    : installation_(installation), outputs_(outputs), about_to_move_(std::move(about_to_move)) {
  for (const McuId id : installation.mcus()) {
    const Mcu& mcu = installation[id];
    const bool never = std::ranges::any_of(
        mcu.motors(), [&](MotorId motor) { return installation.config()[motor].never_disable; });
    const bool disables = mcu.config.idle_disable_s && !never;
    mcus_.add(OfMcu{.disables = disables});
    if (disables || mcu.config.enable_settle_ms > 0) none_ = false;
  }
}

bool IdleDrivers::make_ready(std::int64_t now_us, McuId id) {
  Mcu& mcu = installation_[id];
  OfMcu& own = mcus_[id];
  own.rests = false;
  if (mcu.asleep && !std::exchange(own.waking, true))
    mcu.bus().control(mcu.on_bus(), BUSHD_CONTROL_ENABLE);
  if (mcu.asleep) return false;
  return !own.enabled || now_us >= own.enabled_us + settle_us(mcu);
}

void IdleDrivers::switched(McuId id) {
  installation_[id].asleep = false;
  mcus_[id].waking = false;
  mcus_[id].rests = false;
}

void IdleDrivers::goes_offline(Mcu& mcu, const std::string&) {
  mcus_[mcu.id].waking = false;
  mcus_[mcu.id].enabled = false;
}

void IdleDrivers::reports(std::int64_t now_us, Mcu& mcu) {
  OfMcu& own = mcus_[mcu.id];
  const bool before = std::exchange(own.enabled, enabled(mcu));
  if (own.enabled && !before) own.enabled_us = now_us;
  // After an emergency that has disabled them somebody has to say that they may be enabled.
  if (mcu.asleep && (mcu.report().faults & BUSHD_FAULT_DISABLED) != 0) {
    switched(mcu.id);
    installation_.changed = true;
    return;
  }
  // What it was asked last has been done: asleep with drivers that are enabled, it is awake. One
  // that has not enabled them has a reason, with which a move is refused.
  if (!mcu.asleep || mcu.busy() || (!own.enabled && !own.waking)) return;
  mcu.asleep = own.waking = false;
  installation_.changed = true;
}

// One that is BUSY with drivers that are enabled measures its supply current by a step.
bool IdleDrivers::at_rest(const Mcu& mcu) const {
  if (!enabled(mcu) || mcu.asleep || mcu.busy() || mcu.report().faults != 0) return false;
  if (mcu.report().state == BUSHD_STATE_BUSY) return false;
  return std::ranges::all_of(mcu.motors(), [this](MotorId motor) {
    return installation_[motor].is<motion::Resting>() && !about_to_move_(motor);
  });
}

void IdleDrivers::fall_asleep(Mcu& mcu) {
  mcu.bus().control(mcu.on_bus(), BUSHD_CONTROL_DISABLE);
  mcu.asleep = true;
  mcus_[mcu.id].rests = false;
  installation_.changed = true;
  outputs_.log(LogLevel::kInfo, mcu.id,
               "MCU " + mcu.name() +
                   ": its motors have rested for idle_disable_s, so their drivers "
                   "are disabled until one moves");
}

void IdleDrivers::step(std::int64_t now_us) {
  next_wake_us_ = INT64_MAX;
  if (none_) return;
  for (const McuId id : installation_.mcus()) {
    Mcu& mcu = installation_[id];
    OfMcu& own = mcus_[id];
    const std::int64_t settled_us = own.enabled_us + settle_us(mcu);
    if (own.enabled && settled_us > now_us) next_wake_us_ = std::min(next_wake_us_, settled_us);
    if (!own.disables) continue;
    if (!at_rest(mcu)) {
      own.rests = false;
      continue;
    }
    if (!std::exchange(own.rests, true)) own.rests_since_us = now_us;
    const std::int64_t due_us = own.rests_since_us + idle_us(mcu);
    if (now_us >= due_us) {
      fall_asleep(mcu);
    } else {
      next_wake_us_ = std::min(next_wake_us_, due_us);
    }
  }
}

}  // namespace bushd::daemon
