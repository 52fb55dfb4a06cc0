// Moves that wait for the trigger of their MCU. From when a report tells that the MCU has begun one
// it is a table run like any other.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/model/awaited.h"
#include "daemon/model/service.h"
#include "daemon/services/moves.h"

namespace bushd::daemon {

// Checks the delay of every move that waits for a trigger.
Result<void> check_trigger_delay(std::int64_t delay_us);

class Trigger final : public Service {
 public:
  Trigger(Installation& installation, const Interlocks& interlocks, const Moves& moves,
          OpenMoves& open_moves)
      : installation_(installation),
        interlocks_(interlocks),
        moves_(moves),
        open_moves_(open_moves) {}

  void request(const api::Asker& asker, const api::Arm& request);
  void request(const api::Asker& asker, const api::Disarm& request);
  // As things stand.
  bool would_take(const api::Arm& request) const { return motors_of(request).has_value(); }

  void reports(std::int64_t, Mcu&) override { follow(); }
  void step(std::int64_t) override { follow(); }

 private:
  struct Disarming {
    api::Asker asker;
    std::vector<MotorId> motors;  // that wait still
    std::string done;
  };
  Result<std::vector<MotorId>> motors_of(const api::Arm& request) const;
  units::Steps target_of(MotorId motor, const api::Amount& amount, const api::Arm& request) const;
  std::vector<std::int64_t> steps_of(const std::vector<MotorId>& motors,
                                     const api::Arm& request) const;
  bushd_delay shortest_delay_of(MotorId motor, const api::Arm& request) const;
  Result<void> may_arm(MotorId motor, std::int64_t steps, const api::Arm& request) const;
  void follow();

  Installation& installation_;
  const Interlocks& interlocks_;
  const Moves& moves_;
  OpenMoves& open_moves_;
  Awaited<Disarming> open_;
};

}  // namespace bushd::daemon
