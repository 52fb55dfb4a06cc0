// How long an emergency stop waits in the daemon while other clients of the control socket send as
// much as they can: from the client's send() to the core's door. Prints the median, the 99th of a
// hundred and the longest.
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
#include <string>
#include <thread>
#include <vector>

#include "client/link.h"
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

void flood(const std::string& path, int number, const std::atomic<bool>& ended) {
  auto link = bushd::client::open_socket(path);
  api::Move move;
  for (int i = 0; i < 16; ++i) move.motors.push_back({"motor" + std::to_string(i), 100});
  const bushd::lcm::RequestId id{.client_id = "flood" + std::to_string(number), .number = 1};
  const auto packet = bushd::lcm::encode(0, id, api::Request(move));
  while (!ended) {
    if (!(*link)->send(*packet) || !(*link)->handle([](const auto&) {})) {
      link = bushd::client::open_socket(path);
      if (!link) return;
    }
  }
}

void send_stops(const std::string& path, std::atomic<bool>& ended) {
  const auto link = bushd::client::open_socket(path);
  for (int i = 0; i < kStops; ++i) {
    std::this_thread::sleep_for(kBetweenStops);
    // The number is the time.
    const bushd::lcm::RequestId id{.client_id = "stop", .number = now_ns()};
    static_cast<void>(
        (*link)->send(*bushd::lcm::encode(0, id, api::Request(api::EmergencyStop{}))));
    static_cast<void>((*link)->handle([](const auto&) {}));
  }
  ended = true;
}

void measure(const std::string& path, int floods) {
  std::vector<double> waited_us;
  std::int64_t carried_out = 0;
  bushd::daemon::Reception reception([&](const api::Asker& asker, const api::Request& request) {
    if (api::is_stop(request)) {
      waited_us.push_back(static_cast<double>(now_ns() - asker.number) * 1e-3);
      return asker.answer(api::Accepted{});
    }
    ++carried_out;
    const auto until = Clock::now() + kRequestTakes;
    while (Clock::now() < until) {
    }
    asker.answer(api::Accepted{});
  });
  const auto unix_us = [] { return std::int64_t{0}; };
  bushd::daemon::Publishing publishing(1, 1, 1, {.now_us = unix_us, .unix_us = unix_us});
  auto server = std::move(*bushd::control::Server::open(path, ""));
  bushd::daemon::SocketFront front(*server, 1, reception, publishing, unix_us);
  std::atomic<bool> ended{false};
  std::vector<std::thread> clients;
  for (int i = 0; i < floods; ++i) clients.emplace_back(flood, path, i, std::cref(ended));
  clients.emplace_back(send_stops, path, std::ref(ended));
  while (!ended) {
    pollfd polled{.fd = server->fd(), .events = POLLIN, .revents = 0};
    if (poll(&polled, 1, reception.idle() ? 10 : 0) > 0) front.handle();
    const auto until = Clock::now() + kSlice;
    while (!reception.idle() && Clock::now() < until) reception.carry_out_next();
  }
  server.reset();
  for (std::thread& client : clients) client.join();
  std::sort(waited_us.begin(), waited_us.end());
  fmt::print(
      "{:2} flooding clients, {:7} requests carried out: stop after {:6.0f} us (median), {:6.0f} "
      "us "
      "(99 %), {:6.0f} us (longest)\n",
      floods, carried_out, waited_us[waited_us.size() / 2], waited_us[waited_us.size() * 99 / 100],
      waited_us.back());
}

}  // namespace

int main() {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("bushd-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  for (const int floods : {0, 1, 4, 16}) measure((folder / "control").string(), floods);
  std::filesystem::remove_all(folder);
  return 0;
}
