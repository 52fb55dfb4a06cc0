// One run of the daemon, from its first message to its last: its core, and around it the front end
// on LCM with all that lies between, as the daemon's event loop puts them together. The network is
// a queue in this process; everything passes it as bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/core/core.h"
#include "daemon/fronts/lcm_front.h"
#include "daemon/fronts/publishing.h"
#include "daemon/fronts/reception.h"
#include "lcm/transport.h"

namespace bushfaults {

class DaemonRun {
 public:
  struct Ears {
    // What the core gets, before it does. Who it is then answered through.
    std::function<bushd::api::Asker(const bushd::api::Asker&, const bushd::api::Request&)>
        carry_out;
    // What the daemon says; nothing for a message that cannot be decoded.
    std::function<void(std::optional<bushd::lcm::DaemonMessage>)> said;
    std::function<std::int64_t()> now_us;
  };
  // They outlive it. `run` tells it from others.
  DaemonRun(const bushd::config::Config& config, bushd::daemon::Outputs& outputs, Ears ears,
            std::int64_t run);

  bushd::daemon::Core& core() { return core_; }
  bushd::api::Publisher& publishing() { return publishing_; }
  // A message arrives; all that is said at once is heard before it returns.
  void give(const bushd::lcm::Packet& packet);
  // A request of a client that comes another way.
  void ask(bushd::api::Asker asker, bushd::api::Request request) {
    reception_.take(std::move(asker), std::move(request), 1);
  }
  // As many requests of those that wait as a slice of time may be enough for.
  void carry_out_some();
  bool idle() const { return reception_.idle(); }
  void step();
  // What the core has said.
  void hear();
  // Messages that it could not use.
  std::uint64_t dropped() const { return front_.dropped(); }

 private:
  Ears ears_;
  std::string prefix_;  // of channels
  std::unique_ptr<bushd::lcm::Transport> transport_;
  bushd::daemon::Core core_;
  bushd::daemon::Publishing publishing_;
  bushd::daemon::Reception reception_;
  bushd::daemon::LcmFront front_;
};

}  // namespace bushfaults
