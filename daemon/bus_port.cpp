#include "daemon/bus_port.h"

#include <optional>
#include <string>

#include "config/port_pattern.h"

namespace bushd::daemon {

Result<serial::SerialPort> open_first_port(const config::Bus& bus) {
  std::optional<Error> first_error;
  for (const std::string& path : config::ports_matching(bus.port)) {
    auto opened = serial::SerialPort::open(path, bus.baud);
    if (opened) return opened;
    if (!first_error) first_error = opened.error();
  }
  if (first_error) return fail(*first_error);
  return fail(Error{.message = "no port matches", .file = bus.port});
}

}  // namespace bushd::daemon
