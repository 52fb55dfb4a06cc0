// Stops all motors of all buses as the configuration says, latched in every MCU until its faults
// are cleared.
#pragma once

#include <cstdint>
#include <list>
#include <string>
#include <vector>

#include "daemon/interlocks.h"
#include "daemon/outputs.h"
#include "daemon/service.h"
#include "daemon/services/homing_queue.h"

namespace bushd::daemon {

class EmergencyStop final : public Service {
 public:
  // Whose end is waited for at a time: anybody may send them, as fast as can be. Beyond, they are
  // carried out all the same.
  static constexpr std::size_t kMaxOpen = 256;

  EmergencyStop(Installation& installation, Interlocks& interlocks, HomingQueue& homing,
                OpenMoves& open_moves, Outputs& outputs);

  void request(std::int64_t now_us, const api::Asker& asker, const api::EmergencyStop& request);

  // Commanded, and not yet known to be obeyed everywhere.
  bool under_way() const { return !open_.empty(); }

  void reports(std::int64_t now_us, Mcu&) override { follow(now_us); }
  void step(std::int64_t now_us) override { follow(now_us); }

 private:
  struct Stopping {
    api::Asker asker;
    std::vector<McuId> mcus;  // that do not stand, as far as is known
    std::int64_t deadline_us;
    std::string done = "done";  // the reason, if all goes well
  };
  void follow(std::int64_t now_us);
  Result<void> follow(std::int64_t now_us, Stopping& stopping) const;

  Installation& installation_;
  HomingQueue& homing_;
  OpenMoves& open_moves_;
  Outputs& outputs_;
  std::list<Stopping> open_;
};

}  // namespace bushd::daemon
