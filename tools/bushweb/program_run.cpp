#include "program_run.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

namespace bushweb {
namespace {

// So that it ends by the signals that this process has blocked.
void unblock_signals(posix_spawnattr_t* attributes) {
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(attributes, &none);
  posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGMASK);
}

}  // namespace

ProgramRun::ProgramRun(Poller& poller, Done done) : poller_(poller), done_(std::move(done)) {}

ProgramRun::~ProgramRun() {
  if (fd_ >= 0) {
    poller_.remove(fd_);
    ::close(fd_);
  }
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

bushd::Result<void> ProgramRun::start(const std::vector<std::string>& arguments) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return bushd::fail(std::strerror(errno));
  fd_ = ends[0];
  ::fcntl(fd_, F_SETFL, O_NONBLOCK);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  unblock_signals(&attributes);
  std::vector<char*> words;
  for (const std::string& argument : arguments)
    words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  const int error = ::posix_spawnp(&pid_, words[0], &actions, &attributes, words.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  poller_.add(fd_, [this] { handle(); });
  if (error == 0) return {};
  pid_ = -1;
  return bushd::fail(arguments[0] + " does not start: " + std::strerror(error));
}

void ProgramRun::handle() {
  std::array<char, 4096> bytes;
  ssize_t n = 0;
  while ((n = ::read(fd_, bytes.data(), bytes.size())) > 0) {
    output_.append(bytes.data(), static_cast<std::size_t>(n));
    if (output_.size() > kMostBytes) return end(bushd::fail("it prints too much"));
  }
  if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
  end(std::move(output_));
}

void ProgramRun::end(bushd::Result<std::string> output) {
  const Done done = std::move(done_);
  done(std::move(output));  // destroys this
}

}  // namespace bushweb
