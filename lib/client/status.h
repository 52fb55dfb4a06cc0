// The whole, put together from its parts: the daemon sends state and description per MCU, health
// per bus, each when it changes; the newest of each part counts.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "lcm/codec.h"

namespace bushd::client {

struct Status {
  // By part, as many as there are: of one MCU at the same place.
  std::vector<lcm::StateMessage> states;
  std::vector<lcm::DescriptionMessage> descriptions;
  std::vector<lcm::HealthMessage> healths;  // by bus

  std::int64_t sequence() const;  // of the newest state
};

class StatusCollector {
 public:
  // More than any configuration has; a part beyond is dropped, so that a hostile sender cannot make
  // us keep parts without end.
  static constexpr std::int32_t kMaxParts = 4096;

  void add(const lcm::StateMessage& state);
  void add(const lcm::DescriptionMessage& description);
  void add(const lcm::HealthMessage& health);
  void clear();

  bool has_states() const { return complete(states_); }
  // Each of these: with all its parts.
  bool has_everything() const { return has_states() && has_health() && complete(descriptions_); }
  bool has_motors() const { return has_states() && complete(descriptions_); }
  bool has_health() const { return complete(healths_); }
  // Of what is complete; the rest is empty.
  Status status() const;

 private:
  template <class Message>
  using Parts = std::map<std::int32_t, Message>;

  template <class Message>
  void put(Parts<Message>& parts, const Message& message);
  template <class Message>
  static bool complete(const Parts<Message>& parts) {
    return !parts.empty() &&
           parts.size() == static_cast<std::size_t>(parts.begin()->second.part.parts);
  }

  std::int64_t run_ = 0;
  Parts<lcm::StateMessage> states_;
  Parts<lcm::DescriptionMessage> descriptions_;
  Parts<lcm::HealthMessage> healths_;
};

}  // namespace bushd::client
