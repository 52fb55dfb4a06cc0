// Tells clients how well buses and MCUs do: once a second, and when a port is opened or lost.
#pragma once

#include <cstdint>

#include "daemon/model/installation.h"
#include "daemon/model/outputs.h"

namespace bushd::daemon {

class HealthPublisher {
 public:
  static constexpr std::int64_t kPeriodUs = 1'000'000;

  HealthPublisher(Installation& installation, Outputs& outputs)
      : installation_(installation), outputs_(outputs) {}

  void step(std::int64_t now_us);
  void port_changed() { due_us_ = 0; }
  std::int64_t next_wake_us() const { return due_us_; }

 private:
  api::HealthSnapshot health_of(std::int64_t now_us, const Bus& bus) const;

  Installation& installation_;
  Outputs& outputs_;
  std::int64_t due_us_ = 0;
};

}  // namespace bushd::daemon
