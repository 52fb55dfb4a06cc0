// The daemon's side of a link, made up by the test.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "client/link.h"

namespace bushd::test {

class FakeLink : public client::Link {
 public:
  explicit FakeLink(bool loses) : loses_(loses) {}
  ~FakeLink() override { ::close(fd_); }

  int fd() const override { return fd_; }
  Result<void> send(const lcm::Packet& packet) override {
    auto message = lcm::decode_client_message(packet.channel, packet.payload);
    sent.push_back(std::move(*message));
    if (on_send) on_send(sent.back());
    return {};
  }
  Result<void> handle(const Handler& handler) override {
    eventfd_t ignored = 0;
    ::eventfd_read(fd_, &ignored);
    for (auto messages = std::exchange(waiting_, {}); !messages.empty(); messages.pop_front()) {
      handler(messages.front());
      if (on_handled) on_handled(messages.front());
    }
    if (ended) return fail("the daemon has ended");
    return {};
  }
  bool loses() const override { return loses_; }
  std::string remedy() const override { return "no bushd answers"; }

  void say(lcm::DaemonMessage message) {
    waiting_.push_back(std::move(message));
    ::eventfd_write(fd_, 1);
  }
  void end() {
    ended = true;
    ::eventfd_write(fd_, 1);
  }

  // What the client has sent, and what to do then.
  std::vector<lcm::ClientMessage> sent;
  std::function<void(const lcm::ClientMessage&)> on_send;
  std::function<void(const lcm::DaemonMessage&)> on_handled;
  bool ended = false;

 private:
  bool loses_;
  int fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::deque<lcm::DaemonMessage> waiting_;
};

}  // namespace bushd::test
