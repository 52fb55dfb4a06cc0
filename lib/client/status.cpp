#include "client/status.h"

#include <algorithm>
#include <utility>

namespace bushd::client {

std::int64_t Status::sequence() const {
  std::int64_t newest = 0;
  for (const lcm::StateMessage& state : states) newest = std::max(newest, state.part.sequence);
  return newest;
}

template <class Message>
void StatusCollector::put(Parts<Message>& parts, const Message& message) {
  const lcm::Part& part = message.part;
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
  return out;
}

}  // namespace bushd::client
