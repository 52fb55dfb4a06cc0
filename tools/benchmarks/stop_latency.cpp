// How long an emergency stop waits in the daemon while other clients of the control socket, or of
// LCM, send as much as they can: from the client's send() to the core's door. Prints the median,
// the 99th of a hundred and the longest, once by the clock and once by the processor time of the
// daemon's loop: what it did before it dealt with the stop, however often other programs had the
// processor meanwhile. LCM is measured where its packets find a way
// (tests/tools/with-loopback-multicast).
//
// Front ends, reception and core are the daemon's, put together as its event loop does. The core
// has 256 motors at rest on a virtual bus whose time stands still. Each flooding client opens a
// session and asks for dry runs of all of them, one after the other without waiting for answers; so
// most are refused at the door, and those that are not keep the core at work in slices all the
// time. The figure that noise does not change: how many units of that work were done at most from
// one look at what has arrived to the next.
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "client/link.h"
#include "daemon/fronts/lcm_front.h"
#include "daemon/fronts/reception.h"
#include "daemon/fronts/socket_front.h"
#include "virtual_hall.h"

namespace {

using Clock = std::chrono::steady_clock;
namespace api = bushd::api;

constexpr int kStops = 1000;
constexpr std::chrono::milliseconds kBetweenStops{2};
constexpr std::chrono::microseconds kSlice{bushd::daemon::Reception::kSliceUs};

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

std::int64_t processor_ns(clockid_t of_thread) {
  timespec time{};
  clock_gettime(of_thread, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// When each stop was sent, by number from 1: by the clock, and by what the loop had done until
// then.
struct Sent {
  std::atomic<std::int64_t> ns;
  std::atomic<std::int64_t> processor_ns;
};
using SentStops = std::vector<Sent>;

// Opens a link of a client, or nothing.
using Open = std::function<std::unique_ptr<bushd::client::Link>()>;

// What a client of LCM does first; elsewhere the connection is its session.
std::int64_t open_session(bushd::client::Link& link, const std::string& name,
                          const std::atomic<bool>& ended) {
  std::int64_t session = 0;
  const auto hello = bushd::lcm::encode(0, bushd::lcm::Hello{.client_id = name, .nonce = 1});
  while (link.loses() && session == 0 && !ended) {
    if (!link.send(*hello)) break;
    pollfd polled{.fd = link.fd(), .events = POLLIN, .revents = 0};
    poll(&polled, 1, 50);
    const auto welcomed = [&](const bushd::lcm::DaemonMessage& message) {
      const auto* welcome = std::get_if<bushd::lcm::Welcome>(&message);
      if (welcome != nullptr && welcome->hello.client_id == name) session = welcome->session;
    };
    if (!link.handle(welcomed)) break;
  }
  return session;
}

void flood(const Open& open, int number, const api::Request& dry_run,
           const std::atomic<bool>& ended) {
  const std::string name = "flood" + std::to_string(number);
  while (!ended) {
    const auto link = open();
    if (!link) return;
    bushd::lcm::RequestId id{
        .session = open_session(*link, name, ended), .client_id = name, .number = 0};
    bool good = true;
    while (!ended && good) {
      ++id.number;
      good = link->send(*bushd::lcm::encode(0, id, dry_run)) && link->handle([](const auto&) {});
    }
  }
}

void send_stops(const Open& open, clockid_t loop, SentStops& sent, std::atomic<bool>& ended) {
  const auto link = open();
  for (int i = 0; i < kStops && link; ++i) {
    std::this_thread::sleep_for(kBetweenStops);
    const bushd::lcm::RequestId id{.client_id = "stop", .number = i + 1};
    Sent& now = sent[static_cast<std::size_t>(i)];
    now.processor_ns = processor_ns(loop);
    now.ns = now_ns();
    static_cast<void>(link->send(*bushd::lcm::encode(0, id, api::Request(api::EmergencyStop{}))));
    static_cast<void>(link->handle([](const auto&) {}));
  }
  ended = true;
}

// The daemon without its ports.
struct Daemon {
  explicit Daemon(bench::VirtualHall& of) : hall(of) {}

  // As EventLoop::run does, between two looks at what has arrived.
  void work() {
    hall.core().keep_up(hall.now_us());
    const auto until = Clock::now() + kSlice;
    while (!reception.idle() && !hall.core().begins_moves() && Clock::now() < until) {
      reception.carry_out_next();
    }
    const std::uint64_t before = hall.core().units_of_work();
    hall.core().work();
    const std::uint64_t units = hall.core().units_of_work() - before;
    most_units = std::max(most_units, units);
    slices += units > 0 ? 1 : 0;
  }
  bool idle() const { return reception.idle() && hall.core().next_wake_us() > 0; }

  bench::VirtualHall& hall;
  SentStops sent = SentStops(kStops);
  std::vector<double> waited_us{};
  std::vector<double> processor_us{};
  std::int64_t dry_runs = 0;  // asked for
  std::int64_t slices = 0;
  std::uint64_t most_units = 0;
  bushd::daemon::Reception reception{
      hall.core().counted_stops(), [this](const api::Asker& asker, const api::Request& request) {
        if (api::ends_motion(request)) {
          const Sent& stop = sent.at(static_cast<std::size_t>(asker.number - 1));
          waited_us.push_back(static_cast<double>(now_ns() - stop.ns) * 1e-3);
          processor_us.push_back(
              static_cast<double>(processor_ns(CLOCK_THREAD_CPUTIME_ID) - stop.processor_ns) *
              1e-3);
          return asker.answer(api::Accepted{});
        }
        ++dry_runs;
        hall.core().request(hall.now_us(), asker, request);
      }};
  bushd::daemon::Publishing publishing{
      1, bench::VirtualHall::kMcus, 1, {.now_us = unix_us, .unix_us = unix_us}};

  static std::int64_t unix_us() { return 0; }
};

api::Request dry_run_of_all(const bushd::config::Config& config) {
  api::Move move{.dry_run = true};
  for (const bushd::config::Motor& motor : config.motors) {
    move.motors.push_back({motor.name, 20'000});
  }
  return move;
}

// In microseconds.
std::string figures(std::vector<double> of) {
  std::sort(of.begin(), of.end());
  return fmt::format("{:6.0f} us (median), {:6.0f} us (99 %), {:6.0f} us (longest)",
                     of[of.size() / 2], of[of.size() * 99 / 100], of.back());
}

void measure(const char* way, Daemon& daemon, const Open& open, std::vector<pollfd> fds,
             const std::function<void()>& handle, int floods) {
  std::atomic<bool> ended{false};
  const api::Request dry_run = dry_run_of_all(daemon.hall.config());
  std::vector<std::thread> clients;
  for (int i = 0; i < floods; ++i) {
    clients.emplace_back(flood, std::cref(open), i, std::cref(dry_run), std::cref(ended));
  }
  clockid_t loop{};
  pthread_getcpuclockid(pthread_self(), &loop);
  clients.emplace_back(send_stops, std::cref(open), loop, std::ref(daemon.sent), std::ref(ended));
  while (!ended) {
    if (poll(fds.data(), fds.size(), daemon.idle() ? 10 : 0) > 0) handle();
    daemon.work();
  }
  for (std::thread& client : clients) client.join();
  while (!daemon.idle()) daemon.work();  // its clients' sessions end with the front
  if (daemon.waited_us.empty()) return;
  fmt::print(
      "{}, {:2} flooding clients, {:6} dry runs asked for, {:6} slices of at most {} units: stop "
      "after {}; processor time {}\n",
      way, floods, daemon.dry_runs, daemon.slices, daemon.most_units, figures(daemon.waited_us),
      figures(daemon.processor_us));
}

void measure_socket(const std::string& path, bench::VirtualHall& hall, int floods) {
  Daemon daemon(hall);
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
bool measure_lcm(bench::VirtualHall& hall, int floods) {
  using bushd::lcm::Transport;
  constexpr const char* kUrl = "udpm://239.255.76.67:7667?ttl=0";
  const auto all = Transport::open(kUrl);
  const auto stops = Transport::open(kUrl, {"BENCH_STOP", "BENCH_EMERGENCY_STOP"});
  if (!all || !stops) return false;
  Daemon daemon(hall);
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
  bench::VirtualHall hall;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("bushd-bench-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  for (const int floods : {0, 1, 4, 16}) {
    measure_socket((folder / "control").string(), hall, floods);
  }
  std::filesystem::remove_all(folder);
  for (const int floods : {0, 1, 4, 16}) {
    if (measure_lcm(hall, floods)) continue;
    fmt::print("LCM: no network for it here\n");
    break;
  }
  return 0;
}
