#include "live.h"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <utility>

#include "base/printable.h"
#include "commands.h"

namespace bushctl {
namespace {

using bushd::client::Client;
using bushd::client::Status;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kReopenAfter{250};

class Follower {
 public:
  Follower(const Connection& connection, const Live& live)
      : connection_(connection), live_(live), newest_(Clock::now()) {}

  int run() {
    if (auto opened = open(); !opened) return end(opened.error());
    auto status = first();
    for (;;) {
      if (client_ && client_->interrupted()) return ended(kDone);
      if (status && *status) {
        newest_ = Clock::now();
        shown_ = true;
        if (!live_.show(**status)) return ended(kDone);
      } else if (!status) {
        const bool in_time = live_.for_ever || Clock::now() < newest_ + live_.timeout;
        if (!shown_ || !in_time) return end(status.error());
        live_.on_trouble(status.error().text());
        if (client_ == nullptr || client_->ended()) {
          client_.reset();
          if (!pause()) return ended(kDone);
        }
      }
      if (input() && !live_.on_input()) return ended(kDone);
      status = client_ ? live_.next(*client_, live_.timeout, live_.input_fd) : again();
    }
  }

 private:
  bushd::Result<void> open() {
    auto options = connection_.options();
    options.interrupt_fd = signal_descriptor();
    auto client = Client::open(std::move(options));
    if (!client) return bushd::fail(client.error());
    client_ = std::move(*client);
    if (const std::string& why = client_->barred(); !why.empty() && !shown_) {
      fmt::print(stderr, "bushctl: {}; LCM is used meanwhile\n", bushd::printable(why));
    }
    return {};
  }

  bushd::Result<std::optional<Status>> first() {
    auto status = client_->status(live_.timeout);
    if (!status) return bushd::fail(status.error());
    return std::optional(std::move(*status));
  }

  bushd::Result<std::optional<Status>> again() {
    if (auto opened = open(); !opened) return bushd::fail(opened.error());
    return first();
  }

  // Until it is worth while to look for the daemon again; not if the user wants to end.
  bool pause() const {
    std::array<pollfd, 2> waits{{{.fd = signal_descriptor(), .events = POLLIN, .revents = 0},
                                 {.fd = live_.input_fd, .events = POLLIN, .revents = 0}}};
    ::poll(waits.data(), waits.size(), static_cast<int>(kReopenAfter.count()));
    return waits[0].revents == 0;
  }

  bool input() const {
    pollfd waits{.fd = live_.input_fd, .events = POLLIN, .revents = 0};
    return live_.input_fd >= 0 && ::poll(&waits, 1, 0) > 0;
  }

  int ended(int code) const {
    live_.close();
    return code;
  }

  int end(const bushd::Error& error) const {
    live_.close();
    return client_ ? failure(*client_, error) : failed(error);
  }

  const Connection& connection_;
  const Live& live_;
  std::unique_ptr<Client> client_;
  bool shown_ = false;
  Clock::time_point newest_;
};

}  // namespace

int follow_live(const Connection& connection, const Live& live) {
  return Follower(connection, live).run();
}

}  // namespace bushctl
