// Standard output of a program: what was not written is an error of the program.
#pragma once

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace bushd {

// A reader that goes away must not kill the program without a word of why it ended.
inline void expect_closed_output() {
  std::signal(SIGPIPE, SIG_IGN);
}

// Writes what is still buffered. Returns `exit_code`, or 1 if it was 0 and not all was written,
// which is told on stderr.
inline int finished_output(int exit_code) {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int cause = errno;
  if (flushed && std::ferror(stdout) == 0) return exit_code;
  // "program | head" is no mistake worth a message.
  pollfd output{STDOUT_FILENO, 0, 0};
  const bool reader_gone = poll(&output, 1, 0) > 0 && (output.revents & POLLERR) != 0;
  if (!reader_gone) {
    const char* why = cause != 0 ? std::strerror(cause) : "is the disk full?";
    std::fprintf(stderr, "cannot write to standard output: %s\n", why);
  }
  return exit_code == 0 ? 1 : exit_code;
}

}  // namespace bushd
