#include "screen.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace bushctl {

Screen::Screen(std::string elsewhere) : elsewhere_(std::move(elsewhere)) {
  fmt::print("\x1b[?1049h\x1b[?25l\x1b[?7l");
}

Screen::~Screen() {
  fmt::print("\x1b[?7h\x1b[?25h\x1b[?1049l");
  std::fflush(stdout);
}

void Screen::show(std::vector<std::string> lines) {
  lines_ = std::move(lines);
  draw("");
}

void Screen::notice(const std::string& text) {
  draw(text);
}

void Screen::draw(const std::string& notice) const {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 3;
  const std::size_t room = (known ? size.ws_row : 24u) - 2u;
  // Overwritten from the top, not cleared first: that would flicker.
  std::string screen = "\x1b[H";
  for (std::size_t i = 0; i < lines_.size() && i < room; ++i) screen += lines_[i] + "\x1b[K\n";
  screen += "\x1b[J";
  if (lines_.size() > room) {
    screen += fmt::format("... {} more lines; {}", lines_.size() - room, elsewhere_);
  }
  screen += "\n" + (notice.empty() ? std::string("Ctrl-C ends") : notice);
  fmt::print("{}", screen);
  std::fflush(stdout);
}

}  // namespace bushctl
