// The whole, put together from its parts: the daemon sends state and description per MCU, health
// per bus, each when it changes; the newest of each part counts.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "lcm/codec.h"

namespace bushd::client {

struct Status {
  // By part, as many as there are: of one MCU at the same place.
  std::vector<lcm::StateMessage> states;
  std::vector<lcm::DescriptionMessage> descriptions;
  std::vector<lcm::HealthMessage> healths;  // by bus

  // So many of so many that the daemon has are not above.
  struct Missing {
    std::size_t count = 0;
    std::size_t of = 0;
  };
  Missing missing_mcus{};
  Missing missing_buses{};
  bool answered = true;  // else what is above came by itself
  // Messages that should have come and did not, since the client asked for the status.
  std::uint64_t lost = 0;

  std::int64_t sequence() const;  // of the newest state
};

// The description of the motor at this place in the state; never another one's, whatever the
// network says.
api::MotorDescription description_of(const api::Description& mcu, std::size_t index,
                                     const std::string& motor);

class StatusCollector {
 public:
  // More than any configuration has; a part beyond is dropped, so that a hostile sender cannot make
  // us keep parts without end.
  static constexpr std::int32_t kMaxParts = 4096;

  void add(const lcm::StateMessage& state);
  void add(const lcm::DescriptionMessage& description);
  void add(const lcm::HealthMessage& health);
  void clear();
  // From here on the daemon's messages follow one after the other, so gaps are losses. What comes
  // on request is sent a second time, with the numbers that it had.
  void expect_no_gaps();

  bool empty() const { return states_.empty() && descriptions_.empty() && healths_.empty(); }
  bool has_states() const { return complete(states_); }
  // Each of these: with all its parts.
  bool has_everything() const { return has_states() && has_health() && complete(descriptions_); }
  bool has_motors() const { return has_states() && complete(descriptions_); }
  bool has_health() const { return complete(healths_); }
  // The status as far as it is complete; the rest is empty.
  Status status() const;
  // The status as far as it is there: MCUs with state and description, and buses.
  Status partial_status() const;

 private:
  template <class Message>
  using Parts = std::map<std::int32_t, Message>;

  template <class Message>
  void put(Parts<Message>& parts, const Message& message);
  template <class Message>
  static std::size_t expected(const Parts<Message>& parts) {
    return parts.empty() ? 0 : static_cast<std::size_t>(parts.begin()->second.part.parts);
  }
  template <class Message>
  static bool complete(const Parts<Message>& parts) {
    return !parts.empty() && parts.size() == expected(parts);
  }

  std::int64_t run_ = 0;
  std::int64_t newest_ = 0;  // sequence number of all parts; 0: gaps are not counted
  std::uint64_t lost_ = 0;
  Parts<lcm::StateMessage> states_;
  Parts<lcm::DescriptionMessage> descriptions_;
  Parts<lcm::HealthMessage> healths_;
};

}  // namespace bushd::client
