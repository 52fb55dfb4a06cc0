// Descriptors of ours that wait beside those of the library of HTTP: one epoll, which that waits
// for, with a function for each descriptor.
#pragma once

#include <functional>
#include <map>
#include <memory>

namespace bushweb {

class Poller {
 public:
  using Handler = std::function<void()>;

  Poller();
  ~Poller();
  Poller(const Poller&) = delete;
  Poller& operator=(const Poller&) = delete;

  int fd() const { return epoll_; }
  // `handler` is called while `fd` is readable. It may add and remove, itself too.
  void add(int fd, Handler handler);
  // Before the descriptor is closed.
  void remove(int fd);
  // Calls who is to be called; never waits.
  void handle();

 private:
  int epoll_;
  std::map<int, std::shared_ptr<Handler>> handlers_{};
};

// Becomes readable so many times a second.
class Ticks {
 public:
  explicit Ticks(int per_second);
  ~Ticks();
  Ticks(const Ticks&) = delete;
  Ticks& operator=(const Ticks&) = delete;
  int fd() const { return fd_; }
  void take() const;  // readable no more, until the next one

 private:
  int fd_;
};

}  // namespace bushweb
