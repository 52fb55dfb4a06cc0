// Which virtual bus a configuration asks for.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"

namespace bushsim {

struct Setup {
  std::string bus;
  std::uint32_t baud = 0;
  std::vector<std::uint8_t> addresses;  // at least one
};

// `bus` may be empty if the configuration has one bus only.
bushd::Result<Setup> load_setup(const std::string& config_path, const std::string& bus);

// What runs the firmware of an MCU that is not virtual.
struct Image {
  std::string chip;  // atmega2560, lm3s6965
  std::string path;
};
using Images = std::map<std::uint8_t, Image>;  // by address

// From `2=atmega2560:PATH` and `1=virtual`, for addresses of the bus. Fails if this bushsim has no
// simulator for an image.
bushd::Result<Images> parse_images(const std::vector<std::string>& choices, const Setup& setup);

}  // namespace bushsim
