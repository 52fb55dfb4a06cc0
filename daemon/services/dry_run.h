// What a move would be: planned, expanded and packed into frames by the same code as a true one,
// on copies.
#pragma once

#include <cstdint>
#include <vector>

#include "api/reply.h"
#include "daemon/installation.h"

namespace bushd::daemon {

class DryRun {
 public:
  explicit DryRun(const Installation& installation) : installation_(installation) {}

  struct Part {
    MotorId motor;  // at rest
    std::int64_t steps;
  };
  api::MovePlan plan(std::int64_t now_us, const std::vector<Part>& parts) const;

 private:
  const Installation& installation_;
};

}  // namespace bushd::daemon
