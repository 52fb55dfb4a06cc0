#include "config/port_check.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "config/port_pattern.h"

namespace bushd::config {
namespace {

// One path for all spellings; a port that is not plugged in has one too.
std::filesystem::path plain(const std::string& port) {
  std::error_code error;
  const auto absolute = std::filesystem::absolute(port, error);
  if (error) return port;
  const auto path = std::filesystem::weakly_canonical(absolute, error);
  return error ? absolute : path;
}

}  // namespace

Result<void> check_port(const tables::TomlReader& reader, const Bus& bus,
                        const std::vector<Bus>& others) {
  for (const Bus& other : others) {
    std::error_code missing;
    const bool same = plain(bus.port) == plain(other.port) ||
                      std::filesystem::equivalent(bus.port, other.port, missing);
    if (!same && patterns_may_meet(bus.port, other.port)) {
      return fail(reader.error(
          "port", fmt::format("\"{}\" and \"{}\", the port of bus \"{}\", may be the same port; "
                              "allowed: one bus a port. Write more of the names",
                              bus.port, other.port, other.name)));
    }
    if (!same) continue;
    return fail(reader.error(
        "port", fmt::format("\"{}\" is the port \"{}\" of bus \"{}\"; allowed: one bus "
                            "a port. Put the MCUs of both on one [[bus]]",
                            bus.port, other.port, other.name)));
  }
  return {};
}

}  // namespace bushd::config
