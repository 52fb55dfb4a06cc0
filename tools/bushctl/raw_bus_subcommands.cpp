// Subcommands that have the bus for themselves.
#include <memory>

#include "commands.h"
#include "raw_bus_commands.h"

namespace bushctl {
namespace {

Command add_raw_bus_command(CommandLine& commands, RawBusOptions& options, const char* name,
                            const char* text) {
  Command command = commands.add_local(name, text);
  command.footer("The daemon must not use the port at the same time.")
      .option("PORT", &options.port, "Serial port")
      .number<std::uint32_t>("--baud", &options.baud, 1, kMaxBaud, "Baud rate",
                             Command::Needed::kYes);
  return command;
}

void add_latency_test(CommandLine& commands) {
  struct Options {
    RawBusOptions bus;
    std::uint32_t address = 0;
    std::uint32_t count = 200;
  };
  const auto options = std::make_shared<Options>();
  add_raw_bus_command(commands, options->bus, "latency-test",
                      "Measure the latency of a serial adapter")
      .number<std::uint32_t>("--address", &options->address, 1, 255,
                             "Address of the MCU to ask (default: any)")
      .number<std::uint32_t>("--count", &options->count, 1, 1'000'000, "Number of requests")
      .flag("--json", &options->bus.json, "Print JSON")
      .run([options] {
        return latency_test(options->bus, static_cast<std::uint8_t>(options->address),
                            options->count);
      });
}

void add_scan(CommandLine& commands) {
  const auto options = std::make_shared<RawBusOptions>();
  add_raw_bus_command(commands, *options, "scan",
                      "Find the MCUs on a bus, whatever their addresses")
      .flag("--json", &options->json, "Print JSON")
      .run([options] { return scan(*options); });
}

void add_address(CommandLine& commands) {
  struct Options {
    RawBusOptions bus;
    std::string unique_id;
    std::uint32_t address = 0;
  };
  const auto options = std::make_shared<Options>();
  add_raw_bus_command(commands, options->bus, "address", "Change the address of an MCU permanently")
      .option("UNIQUE_ID", &options->unique_id, "Unique id of the MCU, as 'scan' shows it")
      .number<std::uint32_t>("NEW", &options->address, 1, 255, "New address")
      .run([options] {
        return set_address(options->bus, options->unique_id,
                           static_cast<std::uint8_t>(options->address));
      });
}

}  // namespace

void add_raw_bus_commands(CommandLine& commands) {
  add_latency_test(commands);
  add_scan(commands);
  add_address(commands);
}

}  // namespace bushctl
