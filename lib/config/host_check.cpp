#include "config/host_check.h"

#include <fmt/format.h>
#include <grp.h>

#include <algorithm>
#include <string>
#include <utility>

#include "base/console.h"
#include "config/port_pattern.h"

namespace bushd::config {
namespace {

tl::unexpected<Error> fail_at(Error place, std::string message) {
  place.message = std::move(message);
  return fail(std::move(place));
}

// A pattern passes over consoles if it has other ports, and what is plugged in later may be a
// serial port.
Result<void> check_port(const std::string& port, const Error& place) {
  const auto paths = ports_matching(port);
  if (paths.empty() || !std::ranges::all_of(paths, is_console)) return {};
  return fail_at(place,
                 fmt::format("\"{}\" is {}console{}; allowed: the serial port that the bus "
                             "is connected to",
                             port, paths.size() == 1 ? "a " : "", paths.size() == 1 ? "" : "s"));
}

}  // namespace

Result<void> check_host(const Config& config) {
  const Control& control = config.control;
  const bool has_socket = !control.path || !control.path->empty();
  if (has_socket && !control.group.empty() && ::getgrnam(control.group.c_str()) == nullptr) {
    return fail_at(control.group_at,
                   fmt::format("is \"{}\", and this PC has no such group of users; allowed: one "
                               "that it has (/etc/group), or \"\"",
                               control.group));
  }
  for (const Bus& bus : config.buses) {
    if (auto good = check_port(bus.port, bus.places.at("port")); !good) return good;
  }
  for (const Keypad& keypad : config.keypads) {
    if (auto good = check_port(keypad.port, keypad.port_at); !good) return good;
  }
  return {};
}

}  // namespace bushd::config
