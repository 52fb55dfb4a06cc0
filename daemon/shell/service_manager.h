// What systemd is told, if it runs the daemon: its state, and lines for the journal with fields to
// look for. Without systemd nothing is done, and lines go to standard error.
#pragma once

#include <string>

#include "api/words.h"
#include "base/by_id.h"
#include "config/config.h"
#include "daemon/model/outputs.h"

namespace bushd::daemon {

// While there is one, lines of the program, those of spdlog included, are written by a thread: to
// the journal with their priority, if standard error is a stream of it, else to standard error.
// Neither a terminal that is stopped nor a journal that hangs keeps anybody waiting. At most one.
class Log {
 public:
  Log();
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // All that was said is written. False: it cannot be; then a thread still tries, and the process
  // has to end without waiting for it (std::_Exit).
  bool end();
};

// Fields of a line for the journal, "" for none.
struct JournalFields {
  std::string motor{};
  std::string mcu{};
};
// A line, as spdlog would write it. `MOTOR=` and `MCU=` are its fields in the journal:
// journalctl -u bushd MOTOR=theta.
void write_log(LogLevel level, const std::string& text, const JournalFields& fields = {});

// Before motors move: it waits until systemd has it. All others wait for nothing.
void tell_ready();
void tell_stopping();
// How often it is to be told that the loop lives; 0: nobody asks.
std::int64_t alive_period_us();
void tell_alive();
// A line for `systemctl status`: "2 buses, 32 motors, 1 MCU offline".
std::string status_text(const config::Config& config, const ById<McuId, api::McuState>& mcus);
// False: it could not be told, and has to be told again.
bool tell_status(const std::string& text);

}  // namespace bushd::daemon
