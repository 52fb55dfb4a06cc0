#include "tools/bushctl/program.h"

#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

namespace bushctl::test {

Program::Program(std::vector<std::string> arguments, bool terminal) {
  // Standard error goes to a file in memory: nobody reads it meanwhile, and a full pipe would
  // block.
  err_fd_ = memfd_create("stderr", MFD_CLOEXEC);
  std::array<int, 2> ends{};
  if (terminal) {
    const winsize size{.ws_row = 12, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
    if (openpty(&ends[0], &ends[1], nullptr, nullptr, &size) != 0) return;
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
  } else if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return;
  }
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(err_fd_, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  out_fd_ = ends[0];
}

Program::~Program() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  close(out_fd_);
  close(err_fd_);
}

bool Program::read_some() {
  std::array<char, 4096> buffer{};
  const ssize_t got = read(out_fd_, buffer.data(), buffer.size());
  if (got <= 0) return false;  // a terminal whose program has ended reads as an error
  out_.append(buffer.data(), static_cast<std::size_t>(got));
  return true;
}

bool Program::wait_for(const std::string& text) {
  while (out_.find(text) == std::string::npos) {
    if (!read_some()) return false;
  }
  return true;
}

void Program::send_signal(int signal) const {
  kill(pid_, signal);
}

int Program::finish() {
  while (read_some()) {
  }
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  std::array<char, 4096> buffer{};
  off_t at = 0;
  for (ssize_t got = 0; (got = pread(err_fd_, buffer.data(), buffer.size(), at)) > 0; at += got) {
    err_.append(buffer.data(), static_cast<std::size_t>(got));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace bushctl::test
