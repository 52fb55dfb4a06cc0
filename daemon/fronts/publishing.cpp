#include "daemon/fronts/publishing.h"

#include <algorithm>
#include <utility>

namespace bushd::daemon {
namespace {

// Who publishes twice a second is not put off to the next time because this clock is read later.
constexpr std::int64_t kSlackUs = 20'000;

const char* word(Topic topic) {
  return topic == Topic::kState ? "state" : topic == Topic::kDescription ? "description" : "health";
}

bool moves(const api::StateSnapshot& state) {
  return std::any_of(state.motors.begin(), state.motors.end(),
                     [](const api::MotorState& motor) { return motor.moving; });
}

}  // namespace

Publishing::Publishing(std::int64_t run, std::size_t state_parts, std::size_t buses, Clocks clocks)
    : run_(run),
      clocks_(std::move(clocks)),
      states_(state_parts),
      descriptions_(state_parts),
      healths_(buses) {}

lcm::Part Publishing::part(std::size_t index, std::size_t parts) {
  return {.utime_us = clocks_.unix_us(),
          .run = run_,
          .sequence = ++sequence_,
          .part = static_cast<std::int32_t>(index),
          .parts = static_cast<std::int32_t>(parts)};
}

template <class Snapshot>
void Publishing::send(Topic topic, Slot<Snapshot>& slot, Result<lcm::Packet> packet) {
  slot.sent_us = clocks_.now_us();
  // A configuration is checked to have names that fit: this is a defect, which clients see as
  // silence.
  if (!packet) {
    if (log_) log_(std::string("not published, ") + word(topic) + ": " + packet.error().text());
    return;
  }
  if (slot.packet) newest_bytes_ -= slot.packet->payload.size();
  newest_bytes_ += packet->payload.size();
  slot.packet = std::move(*packet);
  for (Listener* listener : listeners_) listener->hear(topic, *slot.packet);
}

void Publishing::publish(McuId mcu, const api::StateSnapshot& state) {
  if (trouble_.empty() || !state.detail.empty()) return publish_as_told(mcu, state);
  api::StateSnapshot with_trouble = state;
  with_trouble.detail = trouble_;
  publish_as_told(mcu, with_trouble);
}

void Publishing::publish_as_told(McuId mcu, const api::StateSnapshot& state) {
  auto& slot = states_[mcu.value];
  const bool moving = moves(state);
  // The tick goes on while nothing else does.
  const auto changed = [&] {
    if (slot.snapshot) slot.snapshot->tick = state.tick;
    return slot.dropped != dropped_ || slot.snapshot != state;
  };
  const bool due = clocks_.now_us() - slot.sent_us >= kRestingPeriodUs - kSlackUs;
  if (!moving && !due && !changed()) return;
  // What moves is passed on each time, so nothing is compared with it.
  if (moving) {
    slot.snapshot.reset();
  } else {
    slot.snapshot = state;
  }
  slot.dropped = dropped_;
  send(Topic::kState, slot, lcm::encode(part(mcu.value, states_.size()), dropped_, state));
}

void Publishing::publish(McuId mcu, const api::Description& description) {
  auto& slot = descriptions_[mcu.value];
  const bool due = clocks_.now_us() - slot.sent_us >= kDescriptionPeriodUs;
  if (slot.snapshot == description && !due) return;
  slot.snapshot = description;
  send(Topic::kDescription, slot, lcm::encode(part(mcu.value, descriptions_.size()), description));
}

void Publishing::publish(BusId bus, const api::HealthSnapshot& health) {
  auto& slot = healths_[bus.value];
  send(Topic::kHealth, slot, lcm::encode(part(bus.value, healths_.size()), health));
}

void Publishing::publish_lam(const api::CamacLam& lam) {
  const auto packet = lcm::encode(clocks_.unix_us(), lam);
  if (!packet) return;
  for (Listener* listener : listeners_) listener->hear(Topic::kState, *packet);
}

std::vector<const lcm::Packet*> Publishing::newest() {
  if (refresh_) refresh_();
  std::vector<const lcm::Packet*> all;
  const auto add = [&all](const auto& slots) {
    for (const auto& slot : slots) {
      if (slot.packet) all.push_back(&*slot.packet);
    }
  };
  add(descriptions_);
  add(states_);
  add(healths_);
  return all;
}

void Publishing::publish_newest() {
  newest_wanted_ = true;
  step();
}

std::int64_t Publishing::next_wake_us() const {
  return newest_wanted_ ? newest_due_us_ : INT64_MAX;
}

void Publishing::step() {
  const std::int64_t now_us = clocks_.now_us();
  if (!newest_wanted_ || now_us < newest_due_us_) return;
  newest_wanted_ = false;
  if (refresh_) refresh_();
  std::int64_t messages = 0;
  const auto again = [&](Topic topic, const auto& slots) {
    for (const auto& slot : slots) {
      if (!slot.packet) continue;
      ++messages;
      for (Listener* listener : listeners_) listener->hear(topic, *slot.packet);
    }
  };
  again(Topic::kDescription, descriptions_);
  again(Topic::kState, states_);
  again(Topic::kHealth, healths_);
  newest_due_us_ = now_us + std::min(messages * kNewestUsPerMessage, kNewestPeriodUs);
}

}  // namespace bushd::daemon
