// What buses tell: MCUs that go online and offline, reports, late starts. The motors follow it
// first, then the services.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/model/outputs.h"
#include "daemon/services/emergency_stop.h"
#include "daemon/services/journal.h"
#include "daemon/services/moves.h"
#include "daemon/services/positions.h"

namespace bushd::daemon {

class Supervisor {
 public:
  // `services` are told in their order.
  Supervisor(Installation& installation, Journal& journal, Moves& moves, const Positions& positions,
             const KeptPositions& kept, const EmergencyStop& emergency_stop,
             std::vector<Service*> services, Outputs& outputs);

  void handle_events(std::int64_t now_us, Bus& bus);
  // Tells people at once that somebody else talks on a line, and when it is over.
  void watch_for_other_masters(std::int64_t now_us);

 private:
  void goes_online(std::int64_t now_us, Mcu& mcu);
  void goes_offline(std::int64_t now_us, Mcu& mcu);
  void follow_position(MotorId motor, std::int64_t before_steps);
  void reports(std::int64_t now_us, Mcu& mcu);
  void set_up_again();
  void misses_start(const Mcu& mcu, Output output);
  void is_uncertain(const Mcu& mcu, Output output);
  void replans(std::int64_t now_us, const Mcu& mcu, std::uint16_t outputs);

  Installation& installation_;
  Journal& journal_;
  Moves& moves_;
  const Positions& positions_;
  const KeptPositions& kept_;
  const EmergencyStop& emergency_stop_;
  std::vector<Service*> services_;
  Outputs& outputs_;
  struct Heard {
    std::optional<std::uint16_t> boot_number{};  // of the boot that positions belong to
    std::int64_t report_us = 0;                  // the last report
  };
  ById<McuId, Heard> heard_;
  std::vector<McuId> to_set_up_;  // when they rest, since another master has had them
};

}  // namespace bushd::daemon
