// What a master tells the one who drives it.
#pragma once

#include <cstdint>
#include <variant>

#include "bus/rs485/mcu_index.h"
#include "bus/rs485/tick.h"
#include "engine/message.h"

namespace bushd::link {

// Configured, in step, tables in place.
struct McuOnline {
  McuIndex mcu;
};
// No answer, restarted, or port lost: McuView::detail says why.
struct McuOffline {
  McuIndex mcu;
};
// McuView::report is new.
struct McuReported {
  McuIndex mcu;
};
// A replacement was not taken; its motors go on as before. Plan it again.
struct ReplacementFailed {
  McuIndex mcu;
  std::uint16_t motors;  // a mask
};
// The MCU, online, refused a request of `type`.
struct RequestRefused {
  McuIndex mcu;
  std::uint8_t type;
  std::uint8_t status;  // bushd_status
};
// The first ticks of `motor` came too late; its stream was dropped.
struct StartMissed {
  McuIndex mcu;
  std::uint8_t motor;
};
// The motors that were to begin together at this tick (BusMaster::confirm_start) should not begin:
// not all of their MCUs are known to have got their first frames. Give them rest from `at` on.
struct StartUnconfirmed {
  Tick at;
};

// Steps of `motor` may be lost: McuView::uncertain_reason says how many, and why.
struct PositionUncertain {
  McuIndex mcu;
  std::uint8_t motor;
};

// ProgramView is new: an answer to PROGRAM_STATE, progress or the end of an upload. Also of an MCU
// that is still connecting.
struct ProgramReported {
  McuIndex mcu;
};

using Event = std::variant<McuOnline, McuOffline, McuReported, ReplacementFailed, RequestRefused,
                           StartMissed, StartUnconfirmed, PositionUncertain, ProgramReported>;

}  // namespace bushd::link
