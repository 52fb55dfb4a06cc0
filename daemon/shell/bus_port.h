// The serial port of a bus, of whatever kind.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "bus/rs485/pulse_port.h"
#include "config/config.h"
#include "daemon/shell/port_search.h"

namespace bushd::daemon {

// Never blocks. Errors mean that the port is gone.
class BusPort {
 public:
  BusPort() = default;
  virtual ~BusPort() = default;
  BusPort(const BusPort&) = delete;
  BusPort& operator=(const BusPort&) = delete;

  virtual int fd() const = 0;
  virtual const std::string& path() const = 0;
  virtual std::string text() const = 0;  // how it was opened
  virtual Result<void> read(std::vector<std::uint8_t>& bytes) = 0;
  virtual Result<void> write(std::span<const std::uint8_t> bytes) = 0;
  virtual Result<void> flush() { return {}; }
  virtual bool wants_to_write() const { return false; }
  // Carries out an order to a port that is more than bytes.
  virtual Result<link::PulseStatus> carry_out(const link::PulseOrder&) {
    return fail("makes no pulses");
  }
};

// One that is open already.
struct PortInUse {
  std::string path;
  std::string user;  // "bus roof"
};

// The first port that opens of those that the configuration may mean, in this order; else why the
// first of them does not. What `in_use` names, under whatever name, is passed over without being
// opened.
Result<std::unique_ptr<BusPort>> open_first_port(const config::Bus& bus, const PortOrder& order,
                                                 const std::vector<PortInUse>& in_use);

}  // namespace bushd::daemon
