#include "screen.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>

namespace bushctl {

Screen::Screen() {
  fmt::print("\x1b[?1049h\x1b[?25l\x1b[?7l");
}

Screen::~Screen() {
  fmt::print("\x1b[?7h\x1b[?25h\x1b[?1049l");
  std::fflush(stdout);
}

Screen::Size Screen::size() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row <= 3 || size.ws_col == 0)
    return {};
  return {.columns = size.ws_col, .rows = size.ws_row};
}

void Screen::show(const std::vector<std::string>& lines) const {
  // Overwritten from the top, not cleared first: that would flicker.
  const std::size_t rows = size().rows;
  std::string screen = "\x1b[H";
  for (std::size_t i = 0; i < lines.size() && i < rows; ++i) {
    screen += (i > 0 ? "\n" : "") + lines[i] + "\x1b[K";
  }
  fmt::print("{}\x1b[J", screen);
  std::fflush(stdout);
}

std::vector<std::string> cut(std::vector<std::string> lines, std::size_t rows,
                             const std::string& elsewhere, const std::string& last) {
  const std::size_t room = rows - 2;
  if (lines.size() > room) {
    const std::size_t more = lines.size() - room;
    lines.resize(room);
    lines.push_back(fmt::format("... {} more lines; {}", more, elsewhere));
  }
  lines.push_back(last);
  return lines;
}

}  // namespace bushctl
