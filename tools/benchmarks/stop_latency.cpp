// How long an emergency stop waits in the daemon while other clients of the control socket, or of
// LCM, send as much as they can: from the client's send() to the core's door. Prints the median,
// the 99th of a hundred and the longest. LCM is measured where its packets find a way
// (tests/tools/with-loopback-multicast).
//
// The front end, the reception and the slices are the daemon's; in place of the core each request
// takes as long as the move of a group does.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/link.h"
#include "daemon/lcm_front.h"
#include "daemon/reception.h"
#include "daemon/socket_front.h"

namespace {

using Clock = std::chrono::steady_clock;
namespace api = bushd::api;

constexpr int kStops = 1000;
constexpr std::chrono::milliseconds kBetweenStops{2};
constexpr std::chrono::microseconds kRequestTakes{50};
constexpr std::chrono::microseconds kSlice{bushd::daemon::Reception::kSliceUs};

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

// Opens a link of a client, or nothing.
using Open = std::function<std::unique_ptr<bushd::client::Link>()>;

void flood(const Open& open, int number, const std::atomic<bool>& ended) {
  auto link = open();
  api::Move move;
  for (int i = 0; i < 16; ++i) move.motors.push_back({"motor" + std::to_string(i), 100});
  const bushd::lcm::RequestId id{.client_id = "flood" + std::to_string(number), .number = 1};
  const auto packet = bushd::lcm::encode(0, id, api::Request(move));
  while (!ended && link) {
    if (!link->send(*packet) || !link->handle([](const auto&) {})) link = open();
  }
}

void send_stops(const Open& open, std::atomic<bool>& ended) {
  const auto link = open();
  for (int i = 0; i < kStops && link; ++i) {
    std::this_thread::sleep_for(kBetweenStops);
    // The number is the time.
    const bushd::lcm::RequestId id{.client_id = "stop", .number = now_ns()};
    static_cast<void>(link->send(*bushd::lcm::encode(0, id, api::Request(api::EmergencyStop{}))));
    static_cast<void>(link->handle([](const auto&) {}));
  }
  ended = true;
}

// The daemon's side without its core.
struct Daemon {
  std::vector<double> waited_us{};
  std::int64_t carried_out = 0;
  bushd::daemon::Reception reception{[this](const api::Asker& asker, const api::Request& request) {
    if (api::is_stop(request)) {
      waited_us.push_back(static_cast<double>(now_ns() - asker.number) * 1e-3);
      return asker.answer(api::Accepted{});
    }
    ++carried_out;
    const auto until = Clock::now() + kRequestTakes;
    while (Clock::now() < until) {
    }
    asker.answer(api::Accepted{});
  }};
  bushd::daemon::Publishing publishing{1, 1, 1, {.now_us = unix_us, .unix_us = unix_us}};

  static std::int64_t unix_us() { return 0; }
};

void measure(const char* way, Daemon& daemon, const Open& open, std::vector<pollfd> fds,
             const std::function<void()>& handle, int floods) {
  std::atomic<bool> ended{false};
  std::vector<std::thread> clients;
  for (int i = 0; i < floods; ++i)
    clients.emplace_back(flood, std::cref(open), i, std::cref(ended));
  clients.emplace_back(send_stops, std::cref(open), std::ref(ended));
  while (!ended) {
    if (poll(fds.data(), fds.size(), daemon.reception.idle() ? 10 : 0) > 0) handle();
    const auto until = Clock::now() + kSlice;
    while (!daemon.reception.idle() && Clock::now() < until) daemon.reception.carry_out_next();
  }
  for (std::thread& client : clients) client.join();
  std::vector<double>& waited_us = daemon.waited_us;
  if (waited_us.empty()) return;
  std::sort(waited_us.begin(), waited_us.end());
  fmt::print(
      "{}, {:2} flooding clients, {:7} requests carried out: stop after {:6.0f} us (median), "
      "{:6.0f} us (99 %), {:6.0f} us (longest)\n",
      way, floods, daemon.carried_out, waited_us[waited_us.size() / 2],
      waited_us[waited_us.size() * 99 / 100], waited_us.back());
}

void measure_socket(const std::string& path, int floods) {
  Daemon daemon;
  auto server = std::move(*bushd::control::Server::open(path, ""));
  bushd::daemon::SocketFront front(*server, 1, daemon.reception, daemon.publishing,
                                   Daemon::unix_us);
  const Open open = [&path] {
    auto link = bushd::client::open_socket(path);
    return link ? std::move(*link) : nullptr;
  };
  measure(
      "socket", daemon, open, {{.fd = server->fd(), .events = POLLIN, .revents = 0}},
      [&front] { front.handle(); }, floods);
}

// As daemon/main.cpp has it: stops by a transport of their own.
bool measure_lcm(int floods) {
  using bushd::lcm::Transport;
  constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0";
  const auto all = Transport::open(kUrl);
  const auto stops = Transport::open(kUrl, {"BENCH_STOP", "BENCH_EMERGENCY_STOP"});
  if (!all || !stops) return false;
  Daemon daemon;
  bushd::daemon::LcmFront front(
      {.transport = **all, .stops = stops->get(), .prefix = "BENCH", .run = 1, .seed = 1},
      daemon.reception, daemon.publishing, Daemon::unix_us);
  if (!front.subscribe()) return false;
  const Open open = [] {
    auto link = bushd::client::open_lcm(kUrl, "BENCH");
    return link ? std::move(*link) : nullptr;
  };
  measure(
      "LCM", daemon, open,
      {{.fd = (*stops)->fd(), .events = POLLIN, .revents = 0},
       {.fd = (*all)->fd(), .events = POLLIN, .revents = 0}},
      [&front] { front.handle(); }, floods);
  return true;
}

}  // namespace

int main() {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("bushd-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  for (const int floods : {0, 1, 4, 16}) measure_socket((folder / "control").string(), floods);
  std::filesystem::remove_all(folder);
  for (const int floods : {0, 1, 4, 16}) {
    if (measure_lcm(floods)) continue;
    fmt::print("LCM: no network for it here\n");
    break;
  }
  return 0;
}
