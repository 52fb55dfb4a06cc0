#include "bus/port/any_rate.h"

#include <asm/termbits.h>
#include <sys/ioctl.h>

namespace bushd::serial {

std::uint32_t rate_of(int fd) {
  termios2 settings{};
  return ::ioctl(fd, TCGETS2, &settings) == 0 ? settings.c_ospeed : 0;
}

std::uint32_t set_any_rate(int fd, std::uint32_t baud) {
  termios2 settings{};
  if (::ioctl(fd, TCGETS2, &settings) != 0) return 0;
  settings.c_cflag &= ~static_cast<unsigned>(CBAUD | CBAUD << IBSHIFT | CRTSCTS);
  // A modem that hangs up is a switch here.
  settings.c_cflag |= BOTHER | CLOCAL;
  settings.c_ispeed = settings.c_ospeed = baud;
  return ::ioctl(fd, TCSETS2, &settings) == 0 ? rate_of(fd) : 0;
}

}  // namespace bushd::serial
