// Drivers that are disabled after a rest (`idle_disable_s` of an MCU), and enabled again before its
// motors move. EN is common to the motors of an MCU.
#pragma once

#include <cstdint>
#include <functional>

#include "daemon/model/outputs.h"
#include "daemon/model/service.h"

namespace bushd::daemon {

class IdleDrivers final : public Service {
 public:
  // `about_to_move`: a request for this motor has been taken and is not yet carried out.
  IdleDrivers(Installation& installation, Outputs& outputs,
              std::function<bool(MotorId)> about_to_move);

  // No MCU has drivers that are disabled at rest or need time to settle.
  bool none() const { return none_; }
  // Whether motors of this MCU may make steps from now on, as far as its drivers are concerned. If
  // not, they are being enabled, or settle: ask again after the next step. What people have
  // disabled is left alone: true.
  bool make_ready(std::int64_t now_us, McuId mcu);
  // Somebody has asked for its drivers to be enabled or disabled.
  void switched(McuId mcu);

  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const { return next_wake_us_; }

 private:
  struct OfMcu {
    bool disables = false;  // at rest
    bool waking = false;    // asked to enable them
    bool enabled = false;   // as reported last
    std::int64_t enabled_us = 0;
    bool rests = false;
    std::int64_t rests_since_us = 0;
  };
  bool at_rest(const Mcu& mcu) const;
  void fall_asleep(Mcu& mcu);

  Installation& installation_;
  Outputs& outputs_;
  std::function<bool(MotorId)> about_to_move_;
  bool none_ = true;
  ById<McuId, OfMcu> mcus_;
  std::int64_t next_wake_us_ = INT64_MAX;
};

}  // namespace bushd::daemon
