// Tells clients once a second how well buses and MCUs do.
#pragma once

#include <cstdint>

#include "daemon/installation.h"
#include "daemon/outputs.h"

namespace bushd::daemon {

class HealthPublisher {
 public:
  static constexpr std::int64_t kPeriodUs = 1'000'000;

  HealthPublisher(Installation& installation, Outputs& outputs)
      : installation_(installation), outputs_(outputs) {}

  void step(std::int64_t now_us);
  std::int64_t next_wake_us() const { return due_us_; }

 private:
  api::HealthSnapshot health_of(const Bus& bus) const;

  Installation& installation_;
  Outputs& outputs_;
  std::int64_t due_us_ = 0;
};

}  // namespace bushd::daemon
