// Sets where motors stand, and so makes their positions known.
#pragma once

#include <cstdint>
#include <list>
#include <vector>

#include "daemon/confirmation.h"
#include "daemon/interlocks.h"
#include "daemon/service.h"
#include "daemon/services/journal.h"

namespace bushd::daemon {

class Positions final : public Service {
 public:
  Positions(Installation& installation, Interlocks& interlocks, Journal& journal, Outputs& outputs);

  void request(std::int64_t now_us, const api::Asker& asker, const api::SetPosition& request);

  // Its MCU has not yet confirmed a position.
  bool being_set(MotorId motor) const;

  void reports(std::int64_t now_us, Mcu& mcu) override { follow(now_us, &mcu); }
  void step(std::int64_t now_us) override { follow(now_us, nullptr); }

 private:
  struct Part {
    MotorId motor;
    std::int32_t steps;
    std::int64_t from_steps;
  };
  struct Setting {
    Confirmation confirmation;
    std::vector<Part> parts;
  };
  Result<std::vector<Part>> parts_of(const api::SetPosition& request) const;
  void follow(std::int64_t now_us, const Mcu* reported);
  void end(const Setting& setting, const Result<void>& ended);

  Installation& installation_;
  Journal& journal_;
  Outputs& outputs_;
  std::list<Setting> open_;
};

}  // namespace bushd::daemon
