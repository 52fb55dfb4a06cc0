// bushctl setup.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <system_error>

#include "adapters.h"
#include "base/printable.h"
#include "bus_scan.h"
#include "commands.h"
#include "config/config.h"
#include "raw_bus_commands.h"
#include "setup_text.h"
#include "tables/store/atomic_file.h"

namespace bushctl {
namespace {

using bushd::fail;
using bushd::Result;

// Those of the images, and what small chips are given.
constexpr std::array<std::uint32_t, 3> kBauds = {500'000, 1'000'000, 115'200};
// The first that the bus can carry for all MCUs.
constexpr std::array<std::uint32_t, 4> kTicksUs = {2560, 5120, 10'240, 20'000};

struct SetupOptions {
  std::vector<std::string> ports;
  std::uint32_t baud = 0;  // 0: each of kBauds
  std::string output = kSystemConfig;
  bool force = false;
  bool dry_run = false;
};

void say(const std::string& text) {
  fmt::print(stderr, "bushctl: {}\n", bushd::printable(text));
}

// On this port, at the first of these rates at which somebody answers.
Result<FoundBus> find_on(const std::string& port, std::span<const std::uint32_t> bauds) {
  for (const std::uint32_t baud : bauds) {
    auto bus = RawBus::open(port, baud);
    if (!bus) return fail(bus.error());
    auto mcus = find_all(*bus);
    if (!mcus) return fail(mcus.error());
    if (!mcus->empty()) return FoundBus{.port = port, .baud = baud, .mcus = std::move(*mcus)};
  }
  return FoundBus{.port = port, .mcus = {}};
}

// Only buses with an MCU that can be used. Says on stderr what it asks and finds.
std::vector<FoundBus> find_buses(const std::vector<std::string>& ports,
                                 const SetupOptions& options) {
  const std::span<const std::uint32_t> bauds =
      options.baud == 0 ? std::span<const std::uint32_t>(kBauds) : std::span(&options.baud, 1);
  std::vector<FoundBus> buses;
  for (const std::string& port : ports) {
    say(fmt::format("asking {} at {} baud", port, fmt::join(bauds, ", ")));
    auto bus = find_on(port, bauds);
    if (!bus) {
      say(bus.error().text() + "; bushd, if it runs, has to be stopped first");
      continue;
    }
    for (const std::string& line : found_lines(*bus)) say(line);
    if (bus->mcus.empty()) say(port + ": nobody answers");
    if (has_usable_mcu(*bus)) buses.push_back(std::move(*bus));
  }
  return buses;
}

// The text, which the daemon accepts.
Result<std::string> checked_text(const std::vector<FoundBus>& buses, const std::string& path) {
  std::optional<bushd::Error> wrong;
  for (const std::uint32_t tick_us : kTicksUs) {
    std::string text = configuration_text(buses, tick_us, path);
    const auto config = bushd::config::parse(text, path);
    if (config) return text;
    wrong = config.error();
  }
  return fail(*wrong);
}

bool is_there(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(path, error));
}

int set_up(const SetupOptions& options) {
  const std::string& path = options.output;
  if (!options.dry_run && !options.force && is_there(path)) {
    return failed({.message = "is there already, and is left alone; --force replaces it, --output "
                              "names another file, --dry-run only prints",
                   .file = path});
  }
  const auto ports = options.ports.empty() ? serial_adapters() : options.ports;
  const auto buses = find_buses(ports, options);
  if (buses.empty()) {
    for (const std::string& line : nothing_found_lines(ports)) say(line);
    return kFailed;
  }
  const auto text = checked_text(buses, path);
  if (!text) return failed(text.error());
  if (options.dry_run) {
    fmt::print("{}", *text);
    return kDone;
  }
  if (const auto written = bushd::tables::store::replace_file(path, *text); !written) {
    return failed(written.error());
  }
  fmt::print(
      "{}: written; name its motors there, then 'bushd --check-config {}' and 'sudo "
      "systemctl restart bushd'\n",
      bushd::printable(path), bushd::printable(path));
  return kDone;
}

}  // namespace

void add_setup_command(CommandLine& commands) {
  const auto options = std::make_shared<SetupOptions>();
  commands.add_local("setup", "Find MCUs on serial ports, and write a configuration to begin with")
      .footer(
          "Without PORT all serial adapters are asked: a few bytes go out on each. The daemon must "
          "not use them at the same time.")
      .words("PORT", &options->ports, "Serial ports (default: all adapters)", Command::Needed::kNo)
      .number<std::uint32_t>("--baud", &options->baud, 1, kMaxBaud,
                             "Baud rate (default: 500000, 1000000, 115200 in turn)")
      .file("--output", &options->output, "File to write")
      .flag("--force", &options->force, "Replace the file if it is there")
      .flag("--dry-run", &options->dry_run, "Print the configuration; write nothing")
      .run([options] { return set_up(*options); });
}

}  // namespace bushctl
