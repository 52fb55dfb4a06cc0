#include "daemon/shell/poll_set.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>

namespace bushd::daemon {
namespace {

constexpr std::int64_t kUsPerS = 1'000'000;
constexpr std::int64_t kUsPerMs = 1'000;
constexpr std::int64_t kNsPerUs = 1'000;
// A loop that has nothing due looks again all the same.
constexpr std::int64_t kLongestUs = 3'600 * kUsPerS;

Error loop_error(const char* call) {
  return {.message = std::string("event loop: ") + call + ": " + std::strerror(errno)};
}

}  // namespace

PollSet::Watch::Watch(PollSet& of, int fd, Turn turn, Handler handler)
    : set_(of), fd_(fd), turn_(turn), handler_(std::move(handler)) {}

PollSet::Watch::~Watch() {
  set_.forget(this);
}

void PollSet::Watch::await(std::uint32_t events) {
  if (std::exchange(awaited_, events) == events) return;
  epoll_event wanted{.events = events, .data = {.ptr = this}};
  static_cast<void>(::epoll_ctl(set_.fd_, EPOLL_CTL_MOD, fd_, &wanted));
}

PollSet::~PollSet() {
  if (fd_ >= 0) ::close(fd_);
}

Result<void> PollSet::open() {
  fd_ = ::epoll_create1(EPOLL_CLOEXEC);
  if (fd_ < 0) return fail(loop_error("epoll_create1"));
  return {};
}

Result<std::unique_ptr<PollSet::Watch>> PollSet::watch(int fd, Turn turn, Handler handler) {
  std::unique_ptr<Watch> watch(new Watch(*this, fd, turn, std::move(handler)));
  epoll_event wanted{.events = watch->awaited_, .data = {.ptr = watch.get()}};
  if (::epoll_ctl(fd_, EPOLL_CTL_ADD, fd, &wanted) != 0) return fail(loop_error("epoll_ctl"));
  return watch;
}

// It may be among those that are ready: another one's handler ends it.
void PollSet::forget(const Watch* watch) {
  epoll_event unused{};
  static_cast<void>(::epoll_ctl(fd_, EPOLL_CTL_DEL, watch->fd_, &unused));
  for (epoll_event& event : handling_) {
    if (event.data.ptr == watch) event.data.ptr = nullptr;
  }
}

Result<bool> PollSet::handle(std::int64_t wait_us) {
  std::array<epoll_event, kAtOnce> ready;
  const int count = wait(ready, std::min(wait_us, kLongestUs));
  if (count < 0 && errno == EINTR) return false;
  if (count < 0) return fail(loop_error("epoll_wait"));
  handling_ = std::span(ready).first(static_cast<std::size_t>(count));
  for (const Turn turn : {Turn::kFirst, Turn::kUsual}) {
    for (const epoll_event& event : handling_) {
      const auto* watch = static_cast<const Watch*>(event.data.ptr);
      if (watch != nullptr && watch->turn_ == turn) watch->handler_(event.events);
    }
  }
  handling_ = {};
  return count > 0;
}

int PollSet::wait(std::span<epoll_event> ready, std::int64_t wait_us) {
  const int most = static_cast<int>(ready.size());
  if (waits_in_us_) {
    const timespec time{.tv_sec = wait_us / kUsPerS, .tv_nsec = wait_us % kUsPerS * kNsPerUs};
    const int count = ::epoll_pwait2(fd_, ready.data(), most, &time, nullptr);
    if (count >= 0 || (errno != ENOSYS && errno != EPERM)) return count;
    waits_in_us_ = false;
  }
  const auto wait_ms = static_cast<int>((wait_us + kUsPerMs - 1) / kUsPerMs);
  return ::epoll_wait(fd_, ready.data(), most, wait_ms);
}

}  // namespace bushd::daemon
