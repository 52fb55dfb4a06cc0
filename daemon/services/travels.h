// Travel: motors that their MCUs move between two limits, or by a step that a sensor has to see
// (docs/protocol.md, TRAVEL). Modules of CAMAC crates ask for it. Whatever holds for a motion holds
// for it: interlocks, soft limits, marks on the disk, drivers, stops, one result.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/service.h"
#include "daemon/services/idle_drivers.h"
#include "daemon/services/kept_positions.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

// Whether it can travel from one limit switch to another.
Result<void> has_both_limits(const config::Motor& motor);

class Travels final : public Service {
 public:
  Travels(Installation& installation, const Interlocks& interlocks, OpenMoves& open_moves,
          KeptPositions& kept, IdleDrivers& idle_drivers, Outputs& outputs);

  // `message`: without number and motor.
  void request(const api::Asker& asker, MotorId motor, const bushd_travel& message);
  // It ends; at once if its MCU has not been asked yet. A motor that does not travel is left alone.
  void stop(MotorId motor);
  // What the motor's MCU has reported last, if it has begun.
  const bushd_report* progress(MotorId motor) const;

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) override;
  void end_overtaken(std::int64_t now_us) override;
  void step(std::int64_t now_us) override;

 private:
  struct Task {
    MotorId motor;
    bushd_travel message;
    std::optional<std::uint8_t> number{};  // once its MCU has been asked
    bool given_up = false;
  };

  Result<void> may_travel(MotorId motor, const bushd_travel& message) const;
  void ask(std::int64_t now_us, Mcu& mcu);
  void end(Mcu& mcu, api::Outcome outcome, const std::string& reason);

  Installation& installation_;
  const Interlocks& interlocks_;
  OpenMoves& open_;
  KeptPositions& kept_;
  IdleDrivers& idle_drivers_;
  Outputs& outputs_;
  ById<McuId, std::optional<Task>> tasks_;  // one at a time
};

}  // namespace bushd::daemon
