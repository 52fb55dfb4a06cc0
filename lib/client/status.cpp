#include "client/status.h"

#include <algorithm>
#include <utility>

namespace bushd::client {

std::int64_t Status::sequence() const {
  std::int64_t newest = 0;
  for (const lcm::StateMessage& state : states) newest = std::max(newest, state.part.sequence);
  return newest;
}

api::MotorDescription description_of(const api::Description& mcu, std::size_t index,
                                     const std::string& motor) {
  if (index < mcu.motors.size() && mcu.motors[index].name == motor) return mcu.motors[index];
  for (const api::MotorDescription& description : mcu.motors) {
    if (description.name == motor) return description;
  }
  return {};
}

template <class Message>
void StatusCollector::put(Parts<Message>& parts, const Message& message) {
  const lcm::Part& part = message.part;
  if (newest_ > 0 && part.sequence > newest_) {
    lost_ += static_cast<std::uint64_t>(part.sequence - newest_ - 1);
    newest_ = part.sequence;
  }
  if (part.parts < 1 || part.parts > kMaxParts || part.part < 0 || part.part >= part.parts) return;
  // Another daemon than before, maybe of another configuration.
  if (!parts.empty() && parts.begin()->second.part.parts != part.parts) parts.clear();
  const auto [known, first] = parts.try_emplace(part.part, message);
  // The network may change their order.
  if (!first && known->second.part.sequence <= part.sequence) known->second = message;
}

void StatusCollector::add(const lcm::StateMessage& state) {
  if (std::exchange(run_, state.part.run) != state.part.run) clear();
  put(states_, state);
}

void StatusCollector::add(const lcm::DescriptionMessage& description) {
  if (std::exchange(run_, description.part.run) != description.part.run) clear();
  put(descriptions_, description);
}

void StatusCollector::add(const lcm::HealthMessage& health) {
  // It tells no run: a sequence that begins anew is another daemon's.
  const auto known = healths_.find(health.part.part);
  if (known != healths_.end() && health.part.sequence < known->second.part.sequence) {
    healths_.clear();
  }
  put(healths_, health);
}

void StatusCollector::clear() {
  states_.clear();
  descriptions_.clear();
  healths_.clear();
  newest_ = 0;
  lost_ = 0;
}

void StatusCollector::expect_no_gaps() {
  const auto follow = [this](const auto& parts) {
    for (const auto& [index, message] : parts) newest_ = std::max(newest_, message.part.sequence);
  };
  follow(states_);
  follow(descriptions_);
  follow(healths_);
  lost_ = 0;
}

Status StatusCollector::status() const {
  Status out;
  const auto take = [](const auto& parts, auto& all) {
    if (!complete(parts)) return;
    for (const auto& [index, part] : parts) all.push_back(part);
  };
  take(states_, out.states);
  take(descriptions_, out.descriptions);
  take(healths_, out.healths);
  out.lost = lost_;
  return out;
}

Status StatusCollector::partial_status() const {
  Status out;
  for (const auto& [index, state] : states_) {
    const auto description = descriptions_.find(index);
    if (description == descriptions_.end()) continue;
    out.states.push_back(state);
    out.descriptions.push_back(description->second);
  }
  for (const auto& [index, health] : healths_) out.healths.push_back(health);
  // Where nothing tells how many there are: one at least.
  const std::size_t mcus = std::max({expected(states_), expected(descriptions_), std::size_t{1}});
  const std::size_t buses = std::max(expected(healths_), std::size_t{1});
  out.missing_mcus = {.count = mcus - out.states.size(), .of = mcus};
  out.missing_buses = {.count = buses - out.healths.size(), .of = buses};
  out.lost = lost_;
  return out;
}

}  // namespace bushd::client
