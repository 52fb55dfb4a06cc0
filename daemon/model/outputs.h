// Where the core's output goes. Called from within the core's functions; must not call back into
// the core.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "api/session.h"
#include "api/snapshot.h"
#include "base/ids.h"
#include "bus/rs485/pulse_port.h"

namespace bushd::daemon {

enum class LogLevel { kInfo, kWarning, kError };

// Whom a line of the log is about, for who looks for all about a motor.
using LogSubject = std::variant<std::monostate, MotorId, McuId>;

class Outputs : public api::Publisher {
 public:
  virtual void send(BusId bus, std::span<const std::uint8_t> bytes) = 0;
  // An order to a port that is more than bytes; answered by Core::pulse_status, at once.
  virtual void pulse(BusId, const link::PulseOrder&) {}
  virtual void move_log(const std::string& json_line) = 0;
  virtual void log(LogLevel level, LogSubject subject, const std::string& text) = 0;
  // Answered by Core::tables_read and Core::tables_kept, later.
  virtual void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  // For the next daemon: which table each group has, TABLE[@REV] in the order of the configuration.
  virtual void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  // ListTables, GetTable, SetTable: carried out where the disk is, and answered later.
  virtual void serve_tables(const api::Asker& asker, const api::Request& request) = 0;
  virtual std::int64_t wall_clock_us() = 0;  // microseconds since 1970, for messages
};

}  // namespace bushd::daemon
