// The drivers and faults of MCUs, as people switch and clear them.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "daemon/model/confirmation.h"
#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/emergency_stop.h"

namespace bushd::daemon {

class Drivers final : public Service {
 public:
  Drivers(Installation& installation, Interlocks& interlocks, const EmergencyStop& emergency_stop);

  void request(std::int64_t now_us, const api::Asker& asker, const api::Enable& request);
  void request(std::int64_t now_us, const api::Asker& asker, const api::Disable& request);
  void request(std::int64_t now_us, const api::Asker& asker, const api::ClearFaults& request);

  // Told of each MCU whose drivers somebody wants enabled or disabled.
  void set_listener(std::function<void(McuId)> listener) { listener_ = std::move(listener); }

  void reports(std::int64_t now_us, Mcu& mcu) override { follow(now_us, &mcu); }
  void step(std::int64_t now_us) override { follow(now_us, nullptr); }

 private:
  struct Operation {
    Confirmation confirmation;
    std::uint8_t action;  // BUSHD_CONTROL_*
    std::string done;     // what it is when all of these have confirmed it
  };
  struct Targets {
    std::vector<McuId> mcus{};
    std::vector<McuId> out_of_reach{};  // of all; those that are named have to be in reach
  };
  void begin(std::int64_t now_us, const api::Asker& asker, const api::MotorNames& names,
             std::uint8_t action);
  Result<Targets> targets_of(const api::MotorNames& names) const;
  std::string also_meant(const api::MotorNames& names, const std::vector<McuId>& mcus) const;
  void leave_out_what_is_well(Targets& targets) const;
  Result<void> may(std::uint8_t action, const std::vector<McuId>& mcus) const;
  bool being_disabled(McuId mcu) const;
  void follow(std::int64_t now_us, const Mcu* reported);

  Installation& installation_;
  const EmergencyStop& emergency_stop_;
  std::function<void(McuId)> listener_;
  std::list<Operation> open_;
};

}  // namespace bushd::daemon
