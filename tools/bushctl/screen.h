// Lines drawn anew again and again, on the terminal's second screen, so that the first is there
// again afterwards. What is typed here is no command for the shell: who does not read the keys lets
// them be lost.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "raw_terminal.h"

namespace bushctl {

class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  struct Size {
    std::size_t columns = 80;
    std::size_t rows = 24;
  };
  static Size size();

  // From the top; those for which there is no room are not shown, and long ones are clipped.
  void show(const std::vector<std::string>& lines) const;

  // Keys that have been pressed since; nothing once the terminal is gone.
  std::optional<std::string> keys() { return terminal_.read_all(); }

 private:
  RawTerminal terminal_;
};

// As much of a line of text as there are columns for, and that there is more: ">" in the last one.
std::string clipped(const std::string& line, std::size_t columns);

// For a screen of so many rows: these, as far as there is room, then that there are more and where
// (`elsewhere`), and a last line.
std::vector<std::string> cut(std::vector<std::string> lines, std::size_t rows,
                             const std::string& elsewhere, const std::string& last);

}  // namespace bushctl
