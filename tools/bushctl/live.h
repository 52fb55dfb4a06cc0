// What is shown again and again, from a daemon that may end and begin anew meanwhile.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "command_line.h"

namespace bushctl {

struct Live {
  // Waits for the next one, or for input.
  using Next = std::function<bushd::Result<std::optional<bushd::client::Status>>(
      bushd::client::Client&, std::chrono::milliseconds, int input_fd)>;

  std::chrono::milliseconds timeout{};  // for the first one; and of later ones, unless `for_ever`
  bool for_ever = false;                // a person looks, and ends it
  Next next;
  // The first one comes before anything is opened. Each returns whether to go on.
  std::function<bool(const bushd::client::Status&)> show;
  std::function<bool()> on_input;
  int input_fd = -1;
  // None has come, or the daemon is away: what is shown is old. Whenever that is so.
  std::function<void(const std::string&)> on_trouble;
  // Before anything is told on stderr.
  std::function<void()> close;
};

// The exit code.
int follow_live(const Connection& connection, const Live& live);

}  // namespace bushctl
