// What systemd is told, if it runs the daemon: its state, and lines for the journal with fields to
// look for. Without systemd nothing is done, and lines go to standard error.
#pragma once

#include <string>

#include "api/words.h"
#include "base/by_id.h"
#include "config/config.h"
#include "daemon/outputs.h"

namespace bushd::daemon {

// From here on all lines of the program go to the journal with their priority, if standard error
// is a stream of it.
void use_journal();

// Fields of a line for the journal, "" for none.
struct JournalFields {
  std::string motor{};
  std::string mcu{};
};
// A line, as spdlog would write it. `MOTOR=` and `MCU=` are its fields in the journal:
// journalctl -u bushd MOTOR=theta.
void write_log(LogLevel level, const std::string& text, const JournalFields& fields);

void tell_ready();
void tell_stopping();
// A line for `systemctl status`: "2 buses, 32 motors, 1 MCU offline".
std::string status_text(const config::Config& config, const ById<McuId, api::McuState>& mcus);
void tell_status(const std::string& text);

}  // namespace bushd::daemon
