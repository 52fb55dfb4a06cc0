// What MCUs report, in words for people.
#pragma once

#include <string>

#include "engine/message.h"

namespace bushd::motion {

// The gravest fault that is latched, and what to do about it; "" if none is.
std::string fault_text(const bushd_report& report);
// Why motors came to rest: an end to "because ".
std::string stop_cause(const bushd_report& report);
std::string reset_cause_word(std::uint8_t cause);      // as in mcu_health_t
std::string system_inputs_words(std::uint8_t inputs);  // as in mcu_state_t
// "its limit switch at the positive end"
std::string switch_at(int direction);
// Whether a limit switch inhibits the direction (+1, -1) of the motor at this output.
bool forbids(const bushd_report& report, unsigned output, int direction);
// What has stopped a motor immediately. Precondition: an emergency has.
std::string stopper(const bushd_report& report, const std::string& mcu);
// Why it is uncertain then where it stands.
std::string stopped_immediately(const bushd_report& report, const std::string& mcu);
// Whether the MCU has switched its drivers off because of a fault, and why a motor that it moved is
// uncertain then. Precondition of the second: it has.
bool has_disabled_drivers(const bushd_report& report);
std::string unpowered(const bushd_report& report, const std::string& mcu);

}  // namespace bushd::motion
