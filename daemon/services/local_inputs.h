// Motors that people move at their MCU, by its inputs or a keypad there: ends that motion, and
// keeps held motors from it. The MCU is told which motors are theirs (LOCAL): one that is taken
// from them ramps down, and when it gets back to them it waits for the next press.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/by_id.h"
#include "daemon/model/service.h"

namespace bushd::daemon {

class LocalInputs final : public Service {
 public:
  explicit LocalInputs(Installation& installation);

  // People may move it at its MCU, which is online.
  bool may_move(MotorId motor) const;
  // They do, by its last report.
  bool move(MotorId motor) const;
  // Precondition: they may. How that goes, is_stopping() and refusal() tell.
  void stop(MotorId motor);
  bool is_stopping(MotorId motor) const;
  // What is_held() says has been told its MCU, or does not concern it.
  bool has_told(MotorId motor) const;
  // Why its MCU did not do what was asked last.
  std::optional<std::string> refusal(MotorId motor) const;

  void goes_online(Mcu& mcu) override;
  void goes_offline(Mcu& mcu, const std::string& cause) override;
  void refuses(Mcu& mcu, std::uint8_t type, std::uint8_t status) override;
  void reports(std::int64_t now_us, Mcu& mcu) override;
  void step(std::int64_t now_us) override;

 private:
  struct Task {
    std::uint16_t stopping = 0;   // outputs
    std::uint16_t inhibited = 0;  // as told last
    std::uint16_t before = 0;     // as told before that
    std::optional<std::uint8_t> refused{};
  };
  std::uint16_t held(const Mcu& mcu) const;
  void follow(Mcu& mcu);
  void tell(Mcu& mcu, std::uint16_t inhibited);

  Installation& installation_;
  ById<McuId, Task> tasks_;
};

}  // namespace bushd::daemon
