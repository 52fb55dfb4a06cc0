// The position compare outputs of MCUs, which pulse when a motor arrives at a position.
#pragma once

#include <cstdint>
#include <list>

#include "daemon/model/confirmation.h"
#include "daemon/model/service.h"

namespace bushd::daemon {

class PositionCompare final : public Service {
 public:
  explicit PositionCompare(Installation& installation) : installation_(installation) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::PositionCompare& request);

  void reports(std::int64_t now_us, Mcu& mcu) override { follow(now_us, &mcu); }
  void step(std::int64_t now_us) override { follow(now_us, nullptr); }

 private:
  Result<MotorId> check(const api::PositionCompare& request) const;
  void follow(std::int64_t now_us, const Mcu* reported);

  Installation& installation_;
  std::list<Confirmation> open_;
};

}  // namespace bushd::daemon
