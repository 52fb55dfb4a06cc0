// What reports have told so far, comparable: the same bytes if and only if all of it is the same,
// whichever report told it.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/message.h"

namespace bushd::test {

inline std::vector<std::uint8_t> told(bushd_report report) {
  report.number = 1;
  report.sections = BUSHD_TELLS_ALL;
  report.motors = static_cast<std::uint16_t>((1u << report.motor_count) - 1u);
  std::vector<std::uint8_t> payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_report(&report, payload.data()));
  return payload;
}

}  // namespace bushd::test
