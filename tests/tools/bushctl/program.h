// Runs a program and keeps what it writes.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace bushctl::test {

class Program {
 public:
  // The first argument is the program's path. `terminal`: its standard output is a pseudo-terminal.
  explicit Program(std::vector<std::string> arguments, bool terminal = false);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  // Blocks until standard output has contained this, or has ended.
  bool wait_for(const std::string& text);
  void send_signal(int signal) const;
  // Reads the rest; returns the exit code, or 128 + the signal that ended it.
  int finish();

  const std::string& out() const { return out_; }
  const std::string& err() const { return err_; }

 private:
  bool read_some();

  pid_t pid_ = -1;
  int out_fd_ = -1;
  int err_fd_ = -1;
  std::string out_;
  std::string err_;
};

}  // namespace bushctl::test
