// Which virtual bus a configuration asks for.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/converter.h"
#include "base/result.h"
#include "sim/switch.h"

namespace bushsim {

struct Setup {
  std::string bus;
  std::uint32_t baud = 0;
  bool pulses = false;                  // a bus of kind "serial-pulse"
  bool positive_off = false;            // of it: its direction line is off in that direction
  std::vector<std::uint8_t> addresses;  // at least one
  std::set<std::uint8_t> measuring;     // of these, the MCUs that measure their supply current
  // Those whose emergency input is active when it is open: closed unless somebody presses.
  std::set<std::uint8_t> emergency_open{};
  bool board = false;                // a bus of kind "commutator"
  std::uint32_t board_start_hz = 0;  // F_start of it; 0: it has a converter
  std::optional<bushd::Converter> converter{};
  std::uint64_t first_unique_id = 1;  // of its MCUs: other buses have others
};

// `bus` may be empty if the configuration has one bus only.
bushd::Result<Setup> load_setup(const std::string& config_path, const std::string& bus);

// What runs the firmware of an MCU that is not virtual.
struct Image {
  std::string chip;  // atmega2560, atmega1284p, lm3s6965; atmega328p of a commutator board
  std::string path;
};
using Images = std::map<std::uint8_t, Image>;  // by address

// From `2=atmega2560:PATH` and `1=virtual`, for addresses of the bus. Fails if this bushsim has no
// simulator for an image.
bushd::Result<Images> parse_images(const std::vector<std::string>& choices, const Setup& setup);

// A switch at a motor of a virtual MCU.
struct SwitchAt {
  std::uint8_t address = 0;
  std::uint8_t output = 0;
  bushd::sim::SwitchOptions options;
};

// From `1.0@-200` or `1.0:9@-200`: address, output, the input that it is connected to (without:
// that with the number of the output), and where it closes; the sign is the end of the travel that
// it is at.
bushd::Result<std::vector<SwitchAt>> parse_switches(const std::vector<std::string>& choices,
                                                    const Setup& setup, const Images& images);

}  // namespace bushsim
