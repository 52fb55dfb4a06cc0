// Consoles, virtual terminals and the like: ttys all of them, and people's, not a line's.
#pragma once

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <string>

namespace bushd {

// Known by its numbers (Documentation/admin-guide/devices.txt of Linux), behind links too, without
// being opened. A path at which nothing is is none.
inline bool is_console(const std::string& path) {
  struct stat status{};
  if (::stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return false;
  constexpr unsigned kTerminals = 4;   // tty0 .. tty63; from 64 on ttyS0
  constexpr unsigned kAlternates = 5;  // tty, console, ptmx, ttyprintk; from 64 on cua0
  const unsigned kind = major(status.st_rdev);
  return (kind == kTerminals || kind == kAlternates) && minor(status.st_rdev) < 64;
}

}  // namespace bushd
