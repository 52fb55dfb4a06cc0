// Homing: the MCUs do it by themselves (docs/protocol.md, HOME). Here is who may be homed, in which
// order, and what came of it. An MCU homes one motor at a time, so those of one MCU wait in a row.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "daemon/interlocks.h"
#include "daemon/outputs.h"
#include "daemon/service.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class HomingQueue final : public Service {
 public:
  HomingQueue(Installation& installation, const Interlocks& interlocks, OpenMoves& open_moves,
              KeptPositions& kept, Outputs& outputs);

  void request(const api::Asker& asker, const api::Home& request);

  bool empty() const;
  // It ends: at once if its MCU has not been asked yet, else when the motor stands. A motor that is
  // not homed is left alone.
  void stop(MotorId motor);
  // Those whose MCUs have not been asked yet end.
  void end_waiting();

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) override;
  void step(std::int64_t now_us) override;

 private:
  struct Task {
    MotorId motor;
    std::uint16_t floor;  // of the fast approach
  };
  struct Queue {
    std::deque<Task> tasks;
    bool asked = false;  // the MCU homes the first; the others wait
  };

  Result<std::vector<MotorId>> motors_of(const api::Home& request) const;
  Result<void> may_home(MotorId motor) const;
  Result<std::uint16_t> floor_of(MotorId motor, const std::optional<api::Speed>& speed) const;
  bushd_home message_for(const Task& task) const;  // precondition: its motor has a home
  void add(const Task& task);
  void begin(Mcu& mcu);
  bool end_if_waiting(MotorId motor);
  void end(Mcu& mcu, api::Outcome outcome, const std::string& reason);

  Installation& installation_;
  const Interlocks& interlocks_;
  OpenMoves& open_;
  KeptPositions& kept_;
  Outputs& outputs_;
  ById<McuId, Queue> queues_;
};

}  // namespace bushd::daemon
