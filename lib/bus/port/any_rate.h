// Baud rates that are any whole number, as Linux has them beside those of POSIX (termios2, BOTHER).
// In a file of its own: its headers and <termios.h> exclude each other.
#pragma once

#include <cstdint>

namespace bushd::serial {

// What the driver has made of `baud`; 0: it cannot be set. Does not wait for bytes under way.
std::uint32_t set_any_rate(int fd, std::uint32_t baud);

// As set now, of a port or, by its master, of a pty; 0: not known.
std::uint32_t rate_of(int fd);

}  // namespace bushd::serial
