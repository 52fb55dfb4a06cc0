// A program that is run beside everything else, for what it prints: `bushctl doctor` takes seconds.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "poller.h"

namespace bushweb {

// One run of a program whose output is wanted.
class ProgramRun {
 public:
  static constexpr std::size_t kMostBytes = 1024 * 1024;

  // `done`: what it has written, once it has ended; the run may be destroyed within.
  using Done = std::function<void(bushd::Result<std::string> output)>;

  ProgramRun(Poller& poller, Done done);
  ~ProgramRun();  // ends it
  ProgramRun(const ProgramRun&) = delete;
  ProgramRun& operator=(const ProgramRun&) = delete;

  // arguments[0] is the program's path, or its name, which is looked for in $PATH.
  bushd::Result<void> start(const std::vector<std::string>& arguments);

 private:
  void handle();
  void end(bushd::Result<std::string> output);

  Poller& poller_;
  Done done_;
  std::string output_{};
  int fd_ = -1;
  pid_t pid_ = -1;
};

}  // namespace bushweb
