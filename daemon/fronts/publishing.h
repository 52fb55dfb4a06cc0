// What is published, as packets, and when: changes at once, an MCU whose motors all rest twice a
// second, descriptions every few seconds. The newest of each is kept for who asks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/snapshot.h"
#include "lcm/codec.h"

namespace bushd::daemon {

enum class Topic { kState, kDescription, kHealth };

// A front end's ears.
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void hear(Topic topic, const lcm::Packet& packet) = 0;
};

class Publishing : public api::Publisher {
 public:
  static constexpr std::int64_t kRestingPeriodUs = 500'000;
  static constexpr std::int64_t kDescriptionPeriodUs = 3'000'000;

  struct Clocks {
    std::function<std::int64_t()> now_us;   // monotonic
    std::function<std::int64_t()> unix_us;  // since 1970
  };
  // Lets the core publish the state as it is now.
  using Refresh = std::function<void()>;
  // `run` tells this run of the daemon from others.
  Publishing(std::int64_t run, std::size_t state_parts, std::size_t buses, Clocks clocks);

  // Outlives this.
  void add(Listener& listener) { listeners_.push_back(&listener); }
  void set_refresh(Refresh refresh) { refresh_ = std::move(refresh); }
  // Told of what cannot be published, each time; its limit is its own.
  using Log = std::function<void(const std::string&)>;
  void set_log(Log log) { log_ = std::move(log); }
  void set_dropped_messages(std::uint64_t count) { dropped_ = static_cast<std::int64_t>(count); }
  // Stands in the `detail` of every MCU that has nothing of its own there; "": nothing does.
  void set_trouble(std::string text) { trouble_ = std::move(text); }

  // The core may publish as often as it likes: a state that has not changed is passed on when its
  // period is over.
  void publish(McuId mcu, const api::StateSnapshot& state) override;
  void publish(McuId mcu, const api::Description& description) override;
  void publish(BusId bus, const api::HealthSnapshot& health) override;
  void publish_lam(const api::CamacLam& lam) override;

  // Description, state and health of everything, the state as it is now.
  std::vector<const lcm::Packet*> newest();
  // Payload bytes of all packets that newest() would give, without a refresh.
  std::size_t newest_bytes() const { return newest_bytes_; }
  // Publishes to all listeners: now, or as soon as what was published for the last who asked has
  // had its time, kNewestUsPerMessage for each message and at most kNewestPeriodUs. All who ask
  // meanwhile are answered by one.
  static constexpr std::int64_t kNewestUsPerMessage = 2'000;
  static constexpr std::int64_t kNewestPeriodUs = 100'000;
  void publish_newest();
  // Publishes what is due; to be called at next_wake_us() at the latest.
  void step();
  std::int64_t next_wake_us() const;

 private:
  template <class Snapshot>
  struct Slot {
    std::optional<Snapshot> snapshot;
    std::optional<lcm::Packet> packet;
    std::int64_t sent_us = 0;
    std::int64_t dropped = 0;  // messages, as told with it
  };

  void publish_as_told(McuId mcu, const api::StateSnapshot& state);
  lcm::Part part(std::size_t index, std::size_t parts);
  template <class Snapshot>
  void send(Topic topic, Slot<Snapshot>& slot, Result<lcm::Packet> packet);

  std::int64_t run_;
  Clocks clocks_;
  Refresh refresh_;
  Log log_;
  std::vector<Listener*> listeners_;
  std::vector<Slot<api::StateSnapshot>> states_;  // by MCU
  std::vector<Slot<api::Description>> descriptions_;
  std::vector<Slot<api::HealthSnapshot>> healths_;  // by bus
  std::size_t newest_bytes_ = 0;
  std::int64_t sequence_ = 0;
  std::int64_t dropped_ = 0;
  std::string trouble_;
  std::int64_t newest_due_us_ = INT64_MIN;  // not before
  bool newest_wanted_ = false;
};

}  // namespace bushd::daemon
