#include "config/port_check.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "config/port_pattern.h"

namespace bushd::config {
namespace {

namespace fs = std::filesystem;

// One path for all spellings. A port that is not plugged in has one too, also behind links: what
// they lead to will be there when it is.
fs::path plain(const std::string& port) {
  constexpr int kMostLinks = 40;  // as many as Linux follows
  std::error_code error;
  fs::path path = fs::absolute(port, error);
  if (error) return port;
  for (int i = 0; i < kMostLinks; ++i) {
    const fs::path folder = fs::weakly_canonical(path.parent_path(), error);
    if (error) return path;
    path = folder / path.filename();
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = folder / target;
  }
  const fs::path canonical = fs::weakly_canonical(path, error);
  return error ? path : canonical;
}

bool is_same(const std::string& a, const std::string& b) {
  return plain(a) == plain(b) || is_same_port(a, b);
}

}  // namespace

Result<void> check_bus_port(const tables::TomlReader& reader, const std::string& port,
                            const std::vector<Bus>& others) {
  for (const Bus& other : others) {
    if (is_same(port, other.port)) {
      return fail(reader.error(
          "port", fmt::format("\"{}\" is the port \"{}\" of bus \"{}\"; allowed: one bus "
                              "a port. Put the MCUs of both on one [[bus]]",
                              port, other.port, other.name)));
    }
    if (!patterns_may_meet(port, other.port)) continue;
    return fail(reader.error(
        "port", fmt::format("\"{}\" and \"{}\", the port of bus \"{}\", may be the same port; "
                            "allowed: one bus a port. Write more of the names",
                            port, other.port, other.name)));
  }
  return {};
}

Result<void> check_keypad_port(const tables::TomlReader& reader, const std::string& port,
                               const Config& others) {
  const auto taken = [&](const std::string& other, const std::string& by) {
    return fail(reader.error(
        "port",
        fmt::format("\"{}\" is already taken: it is, or may be, \"{}\" of {}; allowed: each "
                    "once",
                    port, other, by)));
  };
  for (const Bus& bus : others.buses) {
    if (!is_same(port, bus.port) && !patterns_may_meet(port, bus.port)) continue;
    return taken(bus.port, fmt::format("bus \"{}\"", bus.name));
  }
  for (const Keypad& keypad : others.keypads) {
    if (is_same(port, keypad.port)) return taken(keypad.port, "another [[keypad]]");
  }
  return {};
}

}  // namespace bushd::config
