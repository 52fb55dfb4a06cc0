#include "beginnings.h"

#include <utility>

namespace bushfaults {

std::optional<std::string> Beginnings::watch(TimeNs now_ns, std::size_t index, std::int64_t steps,
                                             bool goes_on) {
  Motor& motor = motors_[index];
  if (motor.steps == steps) return std::nullopt;
  motor.steps = steps;
  const TimeNs before_ns = std::exchange(motor.moved_ns, now_ns);
  const bool begins = now_ns - before_ns > kRestsNs;
  if (goes_on || !since_ns_ || !begins || now_ns < *since_ns_ + kUnderWayNs) return std::nullopt;
  return " begins to move; before came: " + because_;
}

}  // namespace bushfaults
