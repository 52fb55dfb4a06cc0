#include "screen.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace bushctl {
namespace {

bool begins_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0) != 0x80;  // of UTF-8
}

std::size_t characters_in(const std::string& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line, begins_character));
}

}  // namespace

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
  const Size room = size();
  std::string screen = "\x1b[H";
  for (std::size_t i = 0; i < lines.size() && i < room.rows; ++i) {
    const std::string line = clipped(lines[i], room.columns);
    screen += (i > 0 ? "\n" : "") + line;
    // Behind a full line the cursor stands on its last character, and would take that away.
    if (characters_in(line) < room.columns) screen += "\x1b[K";
  }
  if (lines.size() < room.rows) screen += "\n\x1b[J";
  fmt::print("{}", screen);
  std::fflush(stdout);
}

std::string clipped(const std::string& line, std::size_t columns) {
  if (characters_in(line) <= columns) return line;
  std::size_t end = 0;
  for (std::size_t characters = 0; characters < columns; ++end) {
    if (begins_character(line[end])) ++characters;
  }
  return line.substr(0, end - 1) + ">";
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
