// Lines drawn anew again and again, on the terminal's second screen, so that the first is there
// again afterwards. Keys have no meaning meanwhile, and nobody reads them later: what is typed here
// is no command for the shell.
#pragma once

#include <string>
#include <vector>

#include "raw_terminal.h"

namespace bushctl {

class Screen {
 public:
  // `elsewhere`: where to look when there is not room for all lines.
  explicit Screen(std::string elsewhere);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void show(std::vector<std::string> lines);
  // Below the lines shown last.
  void notice(const std::string& text);

 private:
  void draw(const std::string& notice) const;

  RawTerminal terminal_;
  std::string elsewhere_;
  std::vector<std::string> lines_;
};

}  // namespace bushctl
