// What is known of an MCU of a bus.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "bus/rs485/bus_setup.h"
#include "bus/rs485/health.h"
#include "bus/rs485/mcu_index.h"
#include "bus/rs485/tick.h"
#include "engine/message.h"

namespace bushd::link {

enum class McuPhase { kOffline, kConnecting, kOnline };

struct McuView {
  McuPhase phase = McuPhase::kOffline;
  std::string detail = "not heard yet";  // why it is not online
  bool identified = false;
  bushd_identity identity{};
  bool reported = false;  // the fields below are valid
  bushd_report report{};
  // How old the report was when this daemon, having stood still for very long, went on; 0: since
  // then there has been another one.
  std::int64_t outdated_us = 0;
  Tick tick = 0;                                         // report.tick, unwrapped
  std::array<Tick, BUSHD_MOTORS_PER_MCU> known_until{};  // those of the report, unwrapped
  std::string uncertain_reason{};                        // of the last PositionUncertain
  std::string note{};  // what people should know of it while it is online
  // An emergency stop that nobody has cleared binds it, whether it is there or not.
  bool bound_by_stop = false;
};

// Whether it has obeyed an emergency stop of this mode, as its report tells. One that disables
// drivers has come in another mode, too (EmergencyStop): that alone does not do.
inline bool has_obeyed(const McuView& view, bushd_stop_mode mode) {
  const bool disables =
      mode == BUSHD_STOP_DISABLE && (view.identity.capabilities & BUSHD_CAN_DISABLE) != 0;
  const unsigned wanted = BUSHD_FAULT_EMERGENCY | (disables ? unsigned{BUSHD_FAULT_DISABLED} : 0u);
  return (view.report.faults & wanted) == wanted;
}

// Common to the machines of a master. Each keeps for itself what only it needs to know.
struct McuRecord {
  McuSetup setup;
  McuView view;
  McuHealth health;
  // Number of the last report; 0: `view.report` is nothing that a later one can go on from.
  std::uint8_t known = 0;
  bool poll_wanted = false;         // its report is needed sooner than its turn would come
  bool sync_sent = false;           // of the last SYNC it has not told yet
  bool answered = false;            // something that was asked of it, since its last report
  std::uint8_t trigger_number = 0;  // the last that it was given
};

}  // namespace bushd::link
