// Signals of the process, from a descriptor that a loop can watch.
#pragma once

#include <initializer_list>
#include <optional>

#include "base/result.h"

namespace bushd::daemon {

class Signals {
 public:
  Signals() = default;
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  // Precondition: these are blocked in every thread of the process.
  Result<void> open(std::initializer_list<int> signals);
  // Readable while one waits. Precondition: open() has succeeded.
  int fd() const { return fd_; }
  // The next that waits.
  std::optional<int> take();

 private:
  int fd_ = -1;
};

}  // namespace bushd::daemon
