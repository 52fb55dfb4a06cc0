#include "waiter.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;
using bushd::sim::kNsPerSecond;
using bushd::sim::TimeNs;

constexpr std::size_t kMostWatched = 5;
// By default a sleep may take 50 us longer.
constexpr unsigned long kTimerSlackNs = 1'000;

}  // namespace

Result<Waiter> Waiter::create() {
  sigset_t mask;
  sigemptyset(&mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2, SIGRTMIN}) {
    sigaddset(&mask, signal);
  }
  if (::sigprocmask(SIG_BLOCK, &mask, nullptr) != 0) {
    return fail(system_error("signals cannot be blocked"));
  }
  Descriptor signals(::signalfd(-1, &mask, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!signals.valid()) return fail(system_error("signals cannot be read"));
  static_cast<void>(::prctl(PR_SET_TIMERSLACK, kTimerSlackNs));
  return Waiter(std::move(signals));
}

Result<unsigned> Waiter::wait(std::initializer_list<int> descriptors, TimeNs at_most_ns) const {
  std::array<pollfd, kMostWatched> watched{{{signals_.get(), POLLIN, 0}}};
  std::size_t count = 1;
  for (const int descriptor : descriptors) watched.at(count++) = {descriptor, POLLIN, 0};
  const TimeNs ns = std::max<TimeNs>(at_most_ns, 0);
  const timespec timeout{.tv_sec = ns / kNsPerSecond, .tv_nsec = ns % kNsPerSecond};
  if (::ppoll(watched.data(), count, &timeout, nullptr) < 0) {
    if (errno == EINTR) return 0u;
    return fail(system_error("waiting failed"));
  }
  unsigned readable = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (watched[i].revents != 0) readable |= 1u << (i - 1);
  }
  return readable;
}

std::optional<int> Waiter::signal() const {
  signalfd_siginfo info{};
  if (::read(signals_.get(), &info, sizeof info) != sizeof info) return std::nullopt;
  return static_cast<int>(info.ssi_signo);
}

TimeNs monotonic_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerSecond + now.tv_nsec;
}

}  // namespace bushsim
