// What the event loop watches: for the files of that class only.
#pragma once

#include <sys/epoll.h>
#include <systemd/sd-event.h>

#include <cstdint>
#include <utility>

#include "daemon/shell/event_loop.h"

namespace bushd::daemon {

class EventLoop::Source {
 public:
  explicit Source(Handler handler) : handler_(std::move(handler)) {}
  ~Source() { sd_event_source_disable_unref(source_); }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  int watch(sd_event* event, int fd) {
    return sd_event_add_io(
        event, &source_, fd, EPOLLIN,
        [](sd_event_source*, int, std::uint32_t events, void* self) {
          static_cast<Source*>(self)->handler_(events);
          return 0;
        },
        this);
  }
  int watch_signal(sd_event* event, int signal) {
    return sd_event_add_signal(
        event, &source_, signal,
        [](sd_event_source*, const signalfd_siginfo*, void* self) {
          static_cast<Source*>(self)->handler_(0);
          return 0;
        },
        this);
  }
  void await(std::uint32_t events) {
    static_cast<void>(sd_event_source_set_io_events(source_, events));
  }

 private:
  Handler handler_;
  sd_event_source* source_ = nullptr;
};

}  // namespace bushd::daemon
