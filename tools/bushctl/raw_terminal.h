// Standard input as a terminal that gives each key as it is pressed, without an echo. It is as it
// was again afterwards.
#pragma once

#include <termios.h>

#include <optional>
#include <string>

namespace bushctl {

class RawTerminal {
 public:
  RawTerminal();
  ~RawTerminal();
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  static int fd();
  // All bytes that wait; nothing once the terminal is gone.
  std::optional<std::string> read_all();
  // Gives the terminal back and stops this program, as Ctrl-Z does elsewhere, until it is
  // continued.
  void suspend();

 private:
  void take_again();

  termios before_{};
  termios raw_{};
  bool changed_ = false;
};

}  // namespace bushctl
