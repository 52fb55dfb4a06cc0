// Subcommands that have the line for themselves.
#include <memory>

#include "commands.h"
#include "line_commands.h"

namespace bushctl {
namespace {

Command add_line_command(CommandLine& line, LineOptions& options, const char* name,
                         const char* text) {
  Command command = line.add_local(name, text);
  command.footer("The daemon must not use the port at the same time.")
      .option("PORT", &options.port, "Serial port")
      .number<std::uint32_t>("--baud", &options.baud, 1, kMaxBaud, "Baud rate",
                             Command::Needed::kYes);
  return command;
}

void add_latency_test(CommandLine& line) {
  struct Options {
    LineOptions line;
    std::uint32_t address = 0;
    std::uint32_t count = 200;
  };
  const auto options = std::make_shared<Options>();
  add_line_command(line, options->line, "latency-test", "Measure the latency of a serial adapter")
      .number<std::uint32_t>("--address", &options->address, 1, 255,
                             "Address of the MCU to ask (default: any)")
      .number<std::uint32_t>("--count", &options->count, 1, 1'000'000, "Number of requests")
      .flag("--json", &options->line.json, "Print JSON")
      .run([options] {
        return latency_test(options->line, static_cast<std::uint8_t>(options->address),
                            options->count);
      });
}

void add_scan(CommandLine& line) {
  const auto options = std::make_shared<LineOptions>();
  add_line_command(line, *options, "scan", "Find the MCUs on a line, whatever their addresses")
      .flag("--json", &options->json, "Print JSON")
      .run([options] { return scan(*options); });
}

void add_address(CommandLine& line) {
  struct Options {
    LineOptions line;
    std::string unique_id;
    std::uint32_t address = 0;
  };
  const auto options = std::make_shared<Options>();
  add_line_command(line, options->line, "address", "Change the address of an MCU permanently")
      .option("UNIQUE_ID", &options->unique_id, "Unique id of the MCU, as 'scan' shows it")
      .number<std::uint32_t>("NEW", &options->address, 1, 255, "New address")
      .run([options] {
        return set_address(options->line, options->unique_id,
                           static_cast<std::uint8_t>(options->address));
      });
}

}  // namespace

void add_line_commands(CommandLine& line) {
  add_latency_test(line);
  add_scan(line);
  add_address(line);
}

}  // namespace bushctl
