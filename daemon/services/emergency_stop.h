// Stops all motors of all buses as the configuration says, latched in every MCU until people clear
// its faults. It binds each of them until it has confirmed that (link::McuView::bound_by_stop),
// also one that is away: that has it latched before anything else when it comes. Which MCUs are
// bound is kept in the store, over restarts of the daemon; without one, the MCUs that have latched
// a stop tell of it, and it binds those that come after.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "daemon/model/awaited.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/homing_queue.h"
#include "daemon/services/kept_positions.h"

namespace bushd::daemon {

class EmergencyStop final : public Service {
 public:
  EmergencyStop(Installation& installation, Interlocks& interlocks, HomingQueue& homing,
                OpenMoves& open_moves, KeptPositions& kept, Outputs& outputs);

  void request(std::int64_t now_us, const api::Asker& asker, const api::EmergencyStop& request);

  // The store is in use: whom a stop from before binds.
  void take_kept();

  // Commanded, and not yet known to be obeyed everywhere.
  bool under_way() const { return !open_.empty(); }

  void goes_online(Mcu& mcu) override;
  void reports(std::int64_t now_us, Mcu&) override { follow(now_us); }
  void step(std::int64_t now_us) override;

 private:
  struct Stopping {
    api::Asker asker;
    std::vector<McuId> mcus;  // that do not stand, as far as is known
    std::int64_t deadline_us;
    std::string done = "done";  // the reason, if all goes well
  };
  bool is_bound(McuId mcu) const { return installation_[mcu].view().bound_by_stop; }
  void bind(McuId mcu);
  // An MCU tells of a stop that this daemon knows nothing of.
  void heard_from(McuId mcu);
  void keep();
  void follow(std::int64_t now_us);
  Result<void> follow(std::int64_t now_us, Stopping& stopping) const;

  Installation& installation_;
  HomingQueue& homing_;
  OpenMoves& open_moves_;
  KeptPositions& kept_;
  Outputs& outputs_;
  Awaited<Stopping> open_;
  std::set<McuId> bound_;  // as was kept, or noticed, last
};

}  // namespace bushd::daemon
