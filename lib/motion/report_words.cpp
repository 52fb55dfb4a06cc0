#include "motion/report_words.h"

#include <array>
#include <utility>

namespace bushd::motion {
namespace {

void append(std::string& list, const char* word, const char* separator) {
  if (!list.empty()) list += separator;
  list += word;
}

std::string failed_tests(std::uint8_t tests) {
  constexpr std::array<std::pair<int, const char*>, 4> kTests = {{
      {BUSHD_TEST_RAM, "RAM"},
      {BUSHD_TEST_FLASH, "the program's checksum"},
      {BUSHD_TEST_INPUTS, "an input is shorted"},
      {BUSHD_TEST_ENGINE, "wrong answers"},
  }};
  std::string list;
  for (const auto& [test, word] : kTests) {
    if ((tests & test) != 0) append(list, word, ", ");
  }
  return list.empty() ? list : " (" + list + ")";
}

std::string then_enable(bool disabled) {
  return disabled ? ", then 'bushctl enable'" : "";
}

}  // namespace

std::string fault_text(const bushd_report& report) {
  const std::uint8_t faults = report.faults;
  if (faults & BUSHD_FAULT_SELF_TEST) {
    return "self-test failed" + failed_tests(report.failed_tests) +
           "; only a reboot that finds it good lets it move";
  }
  if (faults & BUSHD_FAULT_OVERCURRENT) {
    return "overcurrent, its drivers are disabled (reading now: " + std::to_string(report.current) +
           "); find the cause, run 'bushctl clear', then 'bushctl enable'";
  }
  const bool disabled = (faults & BUSHD_FAULT_DISABLED) != 0;
  if (faults & BUSHD_FAULT_EMERGENCY_INPUT) {
    const bool active = (report.system_inputs & BUSHD_INPUT_EMERGENCY) != 0;
    return std::string("emergency input") + (active ? "" : ", released by now") +
           (disabled ? ", its drivers are disabled" : "") + "; " +
           (active ? "release it, then " : "") + "run 'bushctl clear'" + then_enable(disabled);
  }
  if (faults & BUSHD_FAULT_EMERGENCY) {
    return std::string("emergency stop") + (disabled ? ", its drivers are disabled" : "") +
           "; run 'bushctl clear'" + then_enable(disabled);
  }
  if (disabled) {
    return "its drivers are disabled since an emergency; run 'bushctl clear'" + then_enable(true);
  }
  if (faults & BUSHD_FAULT_EEPROM) {
    return "its stored settings were unreadable, defaults are in use; if its unique id is 0 in "
           "'bushctl health', write that anew (docs/firmware.md), then run 'bushctl clear'";
  }
  if (faults & BUSHD_FAULT_SYNC) return "out of step with the bus";
  if (faults & BUSHD_FAULT_LINK) return "nothing more reached it in motion";
  return {};
}

std::string stop_cause(const bushd_report& report) {
  const std::uint8_t faults = report.faults;
  if (faults & BUSHD_FAULT_OVERCURRENT) return "its supply current was too high";
  if (faults & BUSHD_FAULT_EMERGENCY) return "an emergency stop was commanded";
  if (faults & BUSHD_FAULT_EMERGENCY_INPUT) return "its emergency input was active";
  if (faults & BUSHD_FAULT_DISABLED) return "an emergency disabled its drivers";
  if (faults & BUSHD_FAULT_SELF_TEST) return "its self-test failed";
  if (faults & BUSHD_FAULT_SYNC) return "it fell out of step with the bus";
  return "nothing more reached it in time";
}

std::string reset_cause_word(std::uint8_t cause) {
  switch (cause) {
    case BUSHD_RESET_POWER_ON:
      return "power-on";
    case BUSHD_RESET_EXTERNAL:
      return "external";
    case BUSHD_RESET_BROWN_OUT:
      return "brown-out";
    case BUSHD_RESET_WATCHDOG:
      return "watchdog";
    default:
      return {};
  }
}

std::string system_inputs_words(std::uint8_t inputs) {
  constexpr std::array<std::pair<int, const char*>, 4> kInputs = {{
      {BUSHD_INPUT_EMERGENCY, "emergency"},
      {BUSHD_INPUT_FORWARD, "forward"},
      {BUSHD_INPUT_REVERSE, "reverse"},
      {BUSHD_INPUT_TRIGGER, "trigger"},
  }};
  std::string list;
  for (const auto& [input, word] : kInputs) {
    if ((inputs & input) != 0) append(list, word, " ");
  }
  return list;
}

std::string switch_at(int direction) {
  return std::string("its limit switch at the ") + (direction > 0 ? "positive" : "negative") +
         " end";
}

bool forbids(const bushd_report& report, unsigned output, int direction) {
  const unsigned mask = direction > 0 ? report.forbidden_positive : report.forbidden_negative;
  return (mask >> output & 1) != 0;
}

std::string stopper(const bushd_report& report, const std::string& mcu) {
  const bool by_input = (report.faults & BUSHD_FAULT_EMERGENCY_INPUT) != 0 &&
                        (report.faults & BUSHD_FAULT_EMERGENCY) == 0;
  return by_input ? "the emergency input of MCU " + mcu : "an emergency stop";
}

std::string stopped_immediately(const bushd_report& report, const std::string& mcu) {
  return "it was stopped immediately by " + stopper(report, mcu) + " and may have overrun";
}

bool has_disabled_drivers(const bushd_report& report) {
  return (report.faults & (BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_DISABLED)) != 0;
}

std::string unpowered(const bushd_report& report, const std::string& mcu) {
  const bool overcurrent = (report.faults & BUSHD_FAULT_OVERCURRENT) != 0;
  return "its drivers were disabled by " + (overcurrent ? "overcurrent" : stopper(report, mcu)) +
         " while it moved";
}

}  // namespace bushd::motion
