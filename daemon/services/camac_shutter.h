// The motor behind a BUSHD-1. It makes single steps without a sensor. Automatic travel, and steps
// that a sensor has to see in time, need an MCU that does them by itself: they are refused.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "camac/bushd1.h"
#include "daemon/interlocks.h"
#include "daemon/outputs.h"
#include "daemon/services/camac_asker.h"

namespace bushd::daemon {

class CamacShutter final : public camac::Shutter {
 public:
  CamacShutter(const std::string& name, MotorId motor, Installation& installation,
               const Interlocks& interlocks, Outputs& outputs, AskCore ask)
      : name_(name),
        motor_(motor),
        installation_(installation),
        interlocks_(interlocks),
        outputs_(outputs),
        ask_(std::move(ask)),
        session_(std::make_shared<CamacSession>(name)) {}

  bool step(const camac::SingleStep& step) override;
  bool travel(const camac::Travel& travel) override;
  void stop() override {}  // a single step ends by itself

  // Does what is due, and tells the module what has become of it.
  void follow(std::int64_t now_us, camac::Bushd1& module);

 private:
  bool refuse(const std::string& why);

  const std::string name_;
  const MotorId motor_;
  Installation& installation_;
  const Interlocks& interlocks_;
  Outputs& outputs_;
  AskCore ask_;
  std::shared_ptr<CamacSession> session_;
  std::optional<camac::SingleStep> wanted_;
  bool moves_ = false;
};

}  // namespace bushd::daemon
