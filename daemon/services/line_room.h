// Whether the line of a bus can carry what a request would stream besides all that is under way: a
// request that does not fit is refused, or waits in WaitingRequests, as `streams` of the bus has
// it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "api/request.h"
#include "base/ids.h"
#include "base/result.h"
#include "bus/rs485/common_start.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

class LineRoom {
 public:
  explicit LineRoom(const Installation& installation) : installation_(installation) {}

  // There is a bus of which it is asked.
  bool concerns_any() const;
  // Whether there is room now for this request, which moves these motors. An error: there will be
  // none, or it may not wait.
  Result<bool> has_room(const api::Request& request, const std::vector<MotorId>& motors) const;

 private:
  // `by_mcus`: a line is made by the MCUs of its motors.
  std::optional<link::StartMessages> messages_of(const api::Request& request, MotorId motor,
                                                 bool by_mcus) const;
  bool may_be_by_mcus(const std::vector<MotorId>& motors) const;
  Result<bool> has_room_on(const Bus& bus, const std::vector<link::ToBegin>& together,
                           const api::Request& request) const;

  const Installation& installation_;
};

}  // namespace bushd::daemon
