#include "readiness.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "base/printable.h"
#include "commands.h"

namespace bushctl {
namespace {

using bushd::api::McuState;
using bushd::client::Client;
using bushd::client::ClientOptions;
using bushd::client::Status;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLookAgainAfter{100};
constexpr std::chrono::milliseconds kStateWithin{1000};

// What keeps the first MCU from taking moves that takes none; "": all take them.
std::string what_is_not_ready(const Status& status) {
  if (status.states.empty()) return "the state of its MCUs has not come";
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    if (!status.descriptions.at(i).snapshot.is_mcu()) continue;
    const bushd::api::StateSnapshot& mcu = status.states[i].snapshot;
    if (mcu.state == McuState::kReady || mcu.state == McuState::kRunning) continue;
    return fmt::format("MCU {} is {}{}{}", mcu.mcu, word(mcu.state), mcu.detail.empty() ? "" : ": ",
                       mcu.detail);
  }
  return {};
}

// Whether SIGINT or SIGTERM has come.
bool interrupted_meanwhile() {
  pollfd waits{.fd = signal_descriptor(), .events = POLLIN, .revents = 0};
  return poll(&waits, 1, static_cast<int>(kLookAgainAfter.count())) > 0;
}

}  // namespace

int wait_until_ready(const Connection& connection, std::chrono::milliseconds within) {
  const Clock::time_point end = Clock::now() + within;
  ClientOptions options = connection.options();
  options.interrupt_fd = signal_descriptor();
  std::unique_ptr<Client> client;
  for (;;) {
    std::string missing;
    if (client == nullptr) {
      auto opened = Client::open(options);
      if (opened) client = std::move(*opened);
      if (!opened) missing = opened.error().text();
    }
    if (client != nullptr) {
      const auto status = client->status(kStateWithin);
      if (client->interrupted()) return kInterrupted;
      missing = status ? what_is_not_ready(*status) : status.error().text();
      if (missing.empty()) return kDone;
      if (!status) client = nullptr;  // it may have ended, and another one has begun
    }
    if (Clock::now() >= end) {
      fmt::print(stderr, "bushctl: waited {} s; {}\n",
                 std::chrono::duration<double>(within).count(), bushd::printable(missing));
      return kFailed;
    }
    if (interrupted_meanwhile()) return kInterrupted;
  }
}

}  // namespace bushctl
