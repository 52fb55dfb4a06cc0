#include "setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "base/parse_number.h"
#include "config/config.h"

namespace bushsim {

using bushd::fail;
using bushd::Result;

Result<Setup> load_setup(const std::string& config_path, const std::string& bus) {
  const auto config = bushd::config::load(config_path);
  if (!config) return fail(config.error());
  std::vector<std::string> names;
  for (const auto& candidate : config->buses) names.push_back(candidate.name);
  const std::string choice = fmt::format("choose with --bus: {}", fmt::join(names, ", "));
  if (bus.empty() && names.size() > 1) {
    return fail({.message = "has several buses; " + choice, .file = config_path});
  }
  for (std::size_t i = 0; i < config->buses.size(); ++i) {
    const auto& candidate = config->buses[i];
    if (!bus.empty() && candidate.name != bus) continue;
    Setup setup{.bus = candidate.name,
                .baud = candidate.baud,
                .pulses = candidate.kind == bushd::config::BusKind::kSerialPulse,
                .positive_off = candidate.serial_pulse.positive_off,
                .addresses = {},
                .measuring = {},
                .emergency_open = {},
                .board = candidate.kind == bushd::config::BusKind::kCommutator,
                .board_start_hz = candidate.start_hz,
                .converter = candidate.converter,
                .first_unique_id = (std::uint64_t{i} << 32) + 1};
    for (const auto& mcu : config->mcus) {
      if (mcu.bus.value != i) continue;
      setup.addresses.push_back(mcu.address.value);
      if (mcu.emission.measures()) setup.measuring.insert(mcu.address.value);
      if (mcu.emergency_active_open) setup.emergency_open.insert(mcu.address.value);
    }
    return setup;
  }
  return fail({.message = fmt::format("has no bus \"{}\"; {}", bus, choice), .file = config_path});
}

namespace {

// The package that this bushsim would have needed; empty if it can run the chip's images.
Result<std::string> missing_for(const std::string& chip, bool is_board) {
  if (is_board && chip != "atmega328p") {
    return fail("is neither virtual nor atmega328p:IMAGE.elf, which a commutator board has");
  }
  if (is_board || chip == "atmega2560" || chip == "atmega1284p") {
#ifndef BUSHSIM_AVR
    return "simavr (libsimavr-dev, libdw-dev)";
#endif
    return "";
  }
  if (chip == "lm3s6965") {
#ifndef BUSHSIM_QEMU
    return "QEMU (qemu-system-arm)";
#endif
    return "";
  }
  return fail(
      "is neither virtual nor atmega2560:IMAGE.elf, atmega1284p:IMAGE.elf or lm3s6965:IMAGE.elf");
}

}  // namespace

Result<Images> parse_images(const std::vector<std::string>& choices, const Setup& setup) {
  Images images;
  for (const std::string& choice : choices) {
    const auto fault = [&choice](const std::string& what) {
      return fail(fmt::format("--mcu {}: {}", choice, what));
    };
    const std::size_t equals = choice.find('=');
    const auto read = bushd::parse_number<std::uint8_t>(std::string_view(choice).substr(0, equals));
    if (equals == std::string::npos || !read) {
      return fault("must be ADDRESS=virtual or ADDRESS=CHIP:IMAGE.elf");
    }
    const std::uint8_t address = *read;
    if (std::ranges::find(setup.addresses, address) == setup.addresses.end()) {
      return fault(fmt::format("bus \"{}\" has no MCU of this address", setup.bus));
    }
    const std::string kind = choice.substr(equals + 1);
    if (kind == "virtual") continue;
    const std::size_t colon = std::min(kind.find(':'), kind.size());
    const Image image{kind.substr(0, colon), kind.substr(std::min(colon + 1, kind.size()))};
    const auto missing = missing_for(image.chip, setup.board);
    if (!missing) return fault(missing.error().message);
    if (!missing->empty()) return fault("this bushsim was built without " + *missing);
    if (!std::filesystem::exists(image.path)) return fault("there is no such file");
    images[address] = image;
  }
  return images;
}

Result<std::vector<SwitchAt>> parse_switches(const std::vector<std::string>& choices,
                                             const Setup& setup, const Images& images) {
  // Mechanical ones are like this.
  constexpr std::int64_t kHysteresisSteps = 4;
  constexpr bushd::sim::TimeNs kBounceNs = 3'000'000;
  std::vector<SwitchAt> switches;
  for (const std::string& choice : choices) {
    const auto fault = [&choice](const std::string& what) {
      return fail(fmt::format("--switch {}: {}", choice, what));
    };
    SwitchAt one;
    const char* const end = choice.data() + choice.size();
    auto read = std::from_chars(choice.data(), end, one.address);
    const bool has_output = read.ec == std::errc{} && read.ptr != end && *read.ptr == '.';
    if (has_output) read = std::from_chars(read.ptr + 1, end, one.output);
    std::uint8_t input = one.output;
    if (has_output && read.ec == std::errc{} && read.ptr != end && *read.ptr == ':') {
      read = std::from_chars(read.ptr + 1, end, input);
    }
    const char* const sign = read.ptr + 1;
    const bool has_sign = has_output && read.ec == std::errc{} && end - read.ptr > 2 &&
                          *read.ptr == '@' && (*sign == '-' || *sign == '+');
    if (has_sign) read = std::from_chars(*sign == '+' ? sign + 1 : sign, end, one.options.at_steps);
    if (!has_sign || read.ec != std::errc{} || read.ptr != end || one.output > 15 || input > 15) {
      return fault(
          "must be ADDRESS.OUTPUT@-STEPS or ADDRESS.OUTPUT@+STEPS, with an output 0..15, or "
          "ADDRESS.OUTPUT:INPUT@.. with an input 0..15");
    }
    if (std::ranges::find(setup.addresses, one.address) == setup.addresses.end()) {
      return fault(fmt::format("bus \"{}\" has no MCU of this address", setup.bus));
    }
    if (images.contains(one.address) && !setup.board) {
      return fault("only virtual MCUs can have one");
    }
    one.options.input = input;
    one.options.positive_end = *sign == '+';
    one.options.hysteresis_steps = kHysteresisSteps;
    one.options.bounce_ns = kBounceNs;
    one.options.seed = switches.size();
    switches.push_back(one);
  }
  return switches;
}

}  // namespace bushsim
