#include "daemon/services/link_faults.h"

#include "bus/rs485/faults.h"
#include "motion/report_words.h"

namespace bushd::daemon {

LinkFaults::LinkFaults(Installation& installation, const EmergencyStop& emergency_stop,
                       Outputs& outputs)
    : installation_(installation), emergency_stop_(emergency_stop), outputs_(outputs) {
  for ([[maybe_unused]] const McuId mcu : installation.mcus()) clearing_.add();
}

// An emergency stop is for people to clear, and clearing is for all faults at once.
void LinkFaults::reports(std::int64_t, Mcu& mcu) {
  bool& asked = clearing_[mcu.id].asked;
  const bushd_report& report = mcu.report();
  const bool faulty = (report.faults & (BUSHD_FAULT_LINK | BUSHD_FAULT_SYNC)) != 0 &&
                      (report.faults & link::kPeoplesFaults) == 0 && !emergency_stop_.under_way();
  if (faulty && !asked && report.moving == 0) {
    outputs_.log(LogLevel::kWarning, mcu.id,
                 "MCU " + mcu.name() + ": " + motion::stop_cause(report) +
                     "; positions are read, clearing the fault");
    mcu.bus().control(mcu.on_bus(), BUSHD_CONTROL_CLEAR_FAULTS);
  }
  if (asked != faulty) installation_.changed = true;
  asked = faulty && report.moving == 0;
}

}  // namespace bushd::daemon
