// What a loop waits for: descriptors that are ready, all of those at once. One system call tells of
// them, so a hundred ports that have something cost one look, not a hundred.
#pragma once

#include <sys/epoll.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "base/result.h"

namespace bushd::daemon {

// Belongs to one thread.
class PollSet {
 public:
  using Handler = std::function<void(std::uint32_t events)>;
  // Descriptors that may bring a stop are handled before others that are ready with them.
  enum class Turn { kFirst, kUsual };

  // A descriptor that is watched for as long as this lives: to be destroyed before the descriptor
  // is closed, and not by its own handler.
  class Watch {
   public:
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // EPOLLIN, at first. EPOLLHUP and EPOLLERR are told always.
    void await(std::uint32_t events);

   private:
    friend class PollSet;
    Watch(PollSet& of, int fd, Turn turn, Handler handler);

    PollSet& set_;
    const int fd_;
    const Turn turn_;
    const Handler handler_;
    std::uint32_t awaited_ = EPOLLIN;
  };

  PollSet() = default;
  ~PollSet();
  PollSet(const PollSet&) = delete;
  PollSet& operator=(const PollSet&) = delete;

  Result<void> open();
  // Precondition of both: open() has succeeded. The set outlives the watch.
  Result<std::unique_ptr<Watch>> watch(int fd, Turn turn, Handler handler);
  // Waits until something is ready, for so long at most, and handles up to kAtOnce of what is: with
  // more, those that have waited longest. Returns false if nothing was.
  Result<bool> handle(std::int64_t wait_us);

  // Handled in far less than a millisecond.
  static constexpr int kAtOnce = 16;

 private:
  int wait(std::span<epoll_event> ready, std::int64_t wait_us);
  void forget(const Watch* watch);

  int fd_ = -1;
  bool waits_in_us_ = true;          // the kernel can, from 5.11 on
  std::span<epoll_event> handling_;  // of handle(), while it runs
};

}  // namespace bushd::daemon
