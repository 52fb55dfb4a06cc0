// What a bus asks of a port that is more to it than bytes, and what it hears of it: a serial port
// whose TXD makes pulses (lib/heritage/serial_pulse). An order is carried out in the order of its
// fields, without waiting, and answered by a status at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace bushd::link {

struct PulseOrder {
  std::optional<bool> positive;       // level of the line that tells the direction
  std::optional<std::uint32_t> baud;  // only while no byte is on its way
  std::vector<std::uint8_t> bytes;
};

// Modem lines that are inputs; a bit each, in the order of BUSHD inputs.
enum {
  BUSHD_LINE_CD = 1 << 0,
  BUSHD_LINE_DSR = 1 << 1,
  BUSHD_LINE_CTS = 1 << 2,
  BUSHD_LINE_RI = 1 << 3
};

struct PulseStatus {
  bool any_rate = false;           // the driver takes any whole number of bit/s
  std::uint32_t base = 0;          // of its divisors, bit/s; 0: not known
  std::uint32_t baud = 0;          // made of the last one ordered; 0: none ordered yet
  std::size_t queued = 0;          // bytes that the driver has not sent
  std::optional<bool> empty{};     // behind the driver too nothing is left; none: it cannot tell
  std::uint8_t lines = 0;          // BUSHD_LINE_* that are on
  std::optional<bool> positive{};  // as the direction line is; none: not known
};

}  // namespace bushd::link
