// Controllers without an MCU of the firmware, beside the bus with MCUs: serial ports that make
// pulses, commutator boards, and keypads that jog their motors (docs/heritage.md). They come last
// in the configuration, so that MCUs and motors of the other bus keep their indices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "config/config.h"
#include "sim/switch.h"

namespace bushfaults {

struct BareOptions {
  std::size_t serial_pulse = 0;  // ports, of one motor each
  std::size_t boards = 0;        // of kBareBoardMotors motors each
  std::size_t keypads = 0;       // one a motor, of the first ones
  double faults_per_hour = 1200;
  double commands_per_hour = 3600;

  bool any() const { return serial_pulse + boards > 0; }
};

inline constexpr std::size_t kBareBoardMotors = 3;

// `config` and these. Why not: a keypad without a motor.
bushd::Result<bushd::config::Config> with_bare(const bushd::config::Config& config,
                                               const BareOptions& options, std::uint64_t seed);

// The home switch at CD of the motor of a serial port, by its index in the configuration.
std::optional<bushd::sim::SwitchOptions> bare_home_switch(const bushd::config::Config& config,
                                                          std::size_t motor, std::uint64_t seed);

// "--serial-pulse 2 ...", or nothing.
std::string bare_text(const BareOptions& options);

}  // namespace bushfaults
