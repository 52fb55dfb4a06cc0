// bushsim: a virtual bus with virtual MCUs behind a pty. The only file that includes CLI11 (slow to
// compile).
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/completion.h"
#include "base/parse_error.h"
#include "base/printable.h"
#include "base/standard_output.h"
#include "board_simulator.h"
#include "keypad.h"
#include "pulse_simulator.h"
#include "simulator.h"

namespace {

constexpr int kDone = 0;
constexpr int kFailed = 1;
constexpr int kUsage = 2;

int refuse(const bushd::Error& error) {
  fmt::print(stderr, "bushsim: {}\n", bushd::printable(error.text()));
  return kFailed;
}

// Another one at every start, so that a bushsim that is started again looks like MCUs that have
// booted again.
std::uint16_t fresh_boot_number() {
  const auto seconds = static_cast<std::uint64_t>(std::time(nullptr));
  const auto process = static_cast<std::uint64_t>(::getpid());
  return static_cast<std::uint16_t>(1 + (seconds * 31 + process) % UINT16_MAX);
}

// Makes it, says that it is there, and lets it run until a signal ends it.
template <class Kind, class Options>
int simulate(const Options& options) {
  bushd::Result<void> ended;
  std::string summary;
  {
    const auto simulator = Kind::create(options);
    if (!simulator) return refuse(simulator.error());
    fmt::print("bushsim: ready {}\n", options.links.front());
    std::fflush(stdout);
    ended = (*simulator)->run();
    summary = (*simulator)->summary();
  }
  // Only now, with trace and link put in order: whoever started this may have closed its end of
  // stdout.
  fmt::print("{}", summary);
  if (!ended) return refuse(ended.error());
  return kDone;
}

int run(int argc, char** argv) {
  CLI::App app{"bushsim: virtual MCUs on a virtual RS-485 bus, reached through a pty"};
  app.set_version_flag("--version", BUSHD_VERSION);
  app.footer(
      "SIGUSR1 pulls the serial adapter out: the port and its name are gone, the MCUs live on and\n"
      "hear nothing. SIGUSR2 plugs it in again, under the next --link.\n"
      "SIGRTMIN makes the trigger inputs of all MCUs active, the next one inactive again.\n"
      "SIGINT, SIGTERM and SIGHUP end it.\n"
      "Exit codes: 0 ended by a signal, 1 failed (reason on stderr), 2 wrong usage.");
  bushsim::Options options;
  options.boot_number = fresh_boot_number();
  std::string config;
  std::string bus;
  app.add_option("--config", config, "Configuration of bushd: baud rate and MCUs of the bus");
  app.add_option("--link", options.links,
                 "Symlink to make, the bus's serial port. Given several times: its names in turn, "
                 "each time that it is plugged in")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--trace", options.trace,
                 "Write all edges of STEP, DIR, EN and position compare outputs, and of the inputs "
                 "trigger and emergency, to this VCD file, and currents that are measured");
  std::vector<std::uint8_t> doubled;
  app.add_option("--doubled", doubled, "Add a second MCU with this address: a fault to try")
      ->check(CLI::Range(1, 255))
      ->excludes("--trace");
  std::vector<std::string> mcus;
  app.add_option("--mcu", mcus,
                 "What an MCU is, ADDRESS=KIND: virtual (the default), atmega2560:IMAGE.elf or "
                 "atmega1284p:IMAGE.elf, which run in simavr, or lm3s6965:IMAGE.elf, in QEMU. "
                 "A commutator board is 1=virtual or 1=atmega328p:IMAGE.elf. "
                 "Several times for several")
      ->allow_extra_args(false);
  std::vector<std::string> switches;
  app.add_option("--switch", switches,
                 "A switch at a motor of a virtual MCU, ADDRESS.OUTPUT@STEPS: 1.0@-200 closes 200 "
                 "steps from where it stands now in the negative direction, 1.0@+200 in the "
                 "positive one; 1.0:9@-200 is connected to input 9. At a serial port that makes "
                 "pulses, inputs 0 to 3 are CD, DSR, CTS and RI. Several times for several")
      ->allow_extra_args(false);
  app.add_option("--bus", bus, "Name of the bus, if the configuration has several");
  app.add_option("--boot-number", options.boot_number, "Boot number of all MCUs (default: new)")
      ->check(CLI::Range(0, int{std::numeric_limits<std::uint16_t>::max()}));
  app.add_flag(
      "--keep", options.keep,
      "Virtual MCUs keep tables, settings and programs over resets, as those with flash do");
  app.add_option("--console", options.console,
                 "What is typed is pressed at this MCU: F and R hold its inputs FORWARD and "
                 "REVERSE, X releases them; E presses its emergency input, O shorts its supply as "
                 "its current sensor sees it, and both end that when typed again; P resets it; "
                 "of a virtual MCU W does so as its watchdog, and D as if its power went and came "
                 "back; f, r, s, x are keys of a keypad "
                 "at a line of its own, and what that would show is printed")
      ->check(CLI::Range(1, 255));
  int latency_ms = 0;
  app.add_option("--latency-ms", latency_ms,
                 "Let the serial adapter have a latency timer, as an FT232 has: answers go to the "
                 "host whenever it has run, or when 62 bytes are held. Without: byte by byte")
      ->check(CLI::Range(1, 255));
  auto* const bit_errors =
      app.add_option("--bit-errors", options.adapter.bit_error_rate,
                     "Flip bits between adapter and line, in both directions, each with this "
                     "probability; how many is told at the end")
          ->check(CLI::Range(1e-9, 0.5));
  auto* const seed = app.add_option("--seed", options.adapter.seed,
                                    "Of the bits that are flipped (default: new; it is printed)")
                         ->needs(bit_errors);
  bushsim::ConverterErrors converter;
  auto* const gain =
      app.add_option("--converter-gain", converter.gain,
                     "Of a commutator board with a converter: its gain, times that which the "
                     "configuration has (default 1)")
          ->check(CLI::Range(0.0, 10.0));
  auto* const offset = app.add_option("--converter-offset", converter.offset_codes,
                                      "The same: offset of the converter, in codes (default 0)")
                           ->check(CLI::Range(-255.0, 255.0));
  auto* const drift =
      app.add_option(
             "--converter-drift", converter.drift_per_s,
             "The same: by how much its gain grows in a second, 0.001 for 0.1 % (default 0)")
          ->check(CLI::Range(-1.0, 1.0));
  bool keypad = false;
  app.add_flag("--keypad", keypad,
               "A keypad instead of a bus: what is typed are its keys (f, r, s, x), and what it "
               "would show is printed");
  if (const auto words = bushd::completion_asked(argc, argv)) {
    bushd::print_completion(bushd::complete(app, *words));
    return kDone;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return bushd::answered(app, error) ? kDone : kUsage;
  }

  if (keypad) {
    const auto ended = bushsim::run_keypad(options.links.front());
    return ended ? kDone : refuse(ended.error());
  }
  if (config.empty()) {
    fmt::print(stderr, "--config is required, but with --keypad\nRun with --help for more.\n");
    return kUsage;
  }
  const auto setup = bushsim::load_setup(config, bus);
  if (!setup) return refuse(setup.error());
  options.setup = *setup;
  const auto images = bushsim::parse_images(mcus, *setup);
  if (!images) return refuse(images.error());
  options.images = *images;
  const auto wired = bushsim::parse_switches(switches, *setup, *images);
  if (!wired) return refuse(wired.error());
  options.switches = *wired;
  if (options.console && (setup->pulses || setup->board)) {
    return refuse(
        {"this bus has no MCUs, where somebody could press something: leave out --console"});
  }
  if ((latency_ms != 0 || *bit_errors) && (setup->pulses || setup->board)) {
    return refuse({"this bus has no MCUs: leave out --latency-ms and --bit-errors"});
  }
  if ((*gain || *offset || *drift) && !setup->converter) {
    return refuse(
        {"this bus is no board with a converter: leave out --converter-gain, --converter-offset "
         "and --converter-drift"});
  }
  if (setup->board) {
    if (!doubled.empty()) {
      return refuse({"a commutator board is alone on its line: leave out --doubled"});
    }
    const std::string image = images->empty() ? "" : images->begin()->second.path;
    return simulate<bushsim::BoardSimulator>(bushsim::BoardSimulator::Options{
        options.setup, options.switches, options.links, options.trace, image, converter});
  }
  options.setup.addresses.insert(options.setup.addresses.end(), doubled.begin(), doubled.end());
  if (setup->pulses) return simulate<bushsim::PulseSimulator>(options);
  options.adapter.latency_ns = std::int64_t{latency_ms} * 1'000'000;
  if (*bit_errors) {
    if (!*seed) options.adapter.seed = std::random_device()();
    fmt::print("bushsim: bits are flipped by --seed {}\n", options.adapter.seed);
  }
  return simulate<bushsim::Simulator>(options);
}

}  // namespace

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    return bushd::finished_output(run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushsim: {}\n", bushd::printable(error.what()));
    return kFailed;
  }
}
