// Clears the faults that an MCU latches when the link to it was lost, once they have served their
// purpose: the positions are read and every move has its result.
#pragma once

#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/emergency_stop.h"

namespace bushd::daemon {

class LinkFaults final : public Service {
 public:
  LinkFaults(Installation& installation, const EmergencyStop& emergency_stop, Outputs& outputs);

  void goes_online(Mcu& mcu) override { clearing_[mcu.id] = Clearing{}; }
  void reports(std::int64_t now_us, Mcu& mcu) override;

 private:
  struct Clearing {
    bool asked = false;
  };
  Installation& installation_;
  const EmergencyStop& emergency_stop_;
  Outputs& outputs_;
  ById<McuId, Clearing> clearing_;
};

}  // namespace bushd::daemon
