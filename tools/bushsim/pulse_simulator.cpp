#include "pulse_simulator.h"

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <iterator>

#include "serial/any_rate.h"
#include "serial/line_socket.h"

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;
using bushd::sim::TimeNs;

constexpr std::uint8_t kAddress = 1;
// Edges are exact whenever they are looked at; waking up serves to write them down.
constexpr TimeNs kSleepNs = 20'000'000;

}  // namespace

PulseSimulator::PulseSimulator(const Options& options, std::unique_ptr<bushd::sim::VcdWriter> trace)
    : links_(options.links), trace_(std::move(trace)), drive_(trace_.get()) {
  for (const SwitchAt& one : options.switches) {
    if (one.options.input.value_or(0) < 4) {
      drive_.attach_switch(one.options.input.value_or(0), one.options);
    }
  }
}

PulseSimulator::~PulseSimulator() {
  if (!socket_path_.empty()) ::unlink(socket_path_.c_str());
}

Result<std::unique_ptr<PulseSimulator>> PulseSimulator::create(const Options& options) {
  std::unique_ptr<bushd::sim::VcdWriter> trace;
  if (!options.trace.empty()) {
    auto created = bushd::sim::VcdWriter::create(options.trace, std::array{kAddress});
    if (!created) return fail(created.error());
    trace = std::move(*created);
  }
  std::unique_ptr<PulseSimulator> simulator(new PulseSimulator(options, std::move(trace)));
  if (const auto watched = simulator->watch(); !watched) return fail(watched.error());
  return simulator;
}

Result<void> PulseSimulator::watch() {
  sigset_t mask;
  sigemptyset(&mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2, SIGRTMIN}) {
    sigaddset(&mask, signal);
  }
  if (::sigprocmask(SIG_BLOCK, &mask, nullptr) != 0) {
    return fail(system_error("signals cannot be blocked"));
  }
  signals_ = Descriptor(::signalfd(-1, &mask, SFD_NONBLOCK | SFD_CLOEXEC));
  timer_ = Descriptor(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  epoll_ = Descriptor(::epoll_create1(EPOLL_CLOEXEC));
  if (!signals_.valid() || !timer_.valid() || !epoll_.valid()) {
    return fail(system_error("the event loop cannot be set up"));
  }
  for (const int fd : {signals_.get(), timer_.get()}) {
    if (const auto watched = watch(fd); !watched) return watched;
  }
  start_ns_ = now_ns();
  if (const auto plugged = plug_in(); !plugged) return plugged;
  return set_timer();
}

Result<void> PulseSimulator::watch(int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  if (::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event) != 0) {
    return fail(system_error("the event loop cannot be set up"));
  }
  return {};
}

// The lines first: whoever sees the port finds them.
Result<void> PulseSimulator::plug_in() {
  if (pty_) return {};
  const std::string link = links_[links_used_++ % links_.size()];
  socket_path_ = bushd::serial::LineSocket::path_of(link);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_path_.size() >= sizeof address.sun_path) {
    return fail(
        {.message = "is too long for a socket beside it; give a shorter --link", .file = link});
  }
  std::memcpy(address.sun_path, socket_path_.c_str(), socket_path_.size() + 1);
  ::unlink(socket_path_.c_str());
  listener_ = Descriptor(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!listener_.valid() ||
      ::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), 4) != 0) {
    auto error = system_error("the socket of the modem lines cannot be made");
    error.file = socket_path_;
    return fail(error);
  }
  auto opened = Pty::open(link);
  if (!opened) return fail(opened.error());
  pty_.emplace(std::move(*opened));
  if (const auto watched = watch(listener_.get()); !watched) return watched;
  return watch(pty_->fd());
}

// Closing takes them out of the epoll set.
void PulseSimulator::unplug() {
  drive_.break_off(now_ns());
  pty_.reset();
  client_ = Descriptor();
  listener_ = Descriptor();
  ::unlink(socket_path_.c_str());
}

Result<void> PulseSimulator::take_signal() {
  signalfd_siginfo info{};
  if (::read(signals_.get(), &info, sizeof info) != sizeof info) {
    return fail(system_error("a signal cannot be read"));
  }
  if (info.ssi_signo == static_cast<std::uint32_t>(SIGRTMIN)) return {};  // no trigger input
  if (info.ssi_signo == SIGUSR1) {
    if (pty_) unplug();
  } else if (info.ssi_signo == SIGUSR2) {
    return plug_in();
  } else {
    ended_ = true;
  }
  return {};
}

TimeNs PulseSimulator::now_ns() const {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * bushd::sim::kNsPerSecond + now.tv_nsec - start_ns_;
}

// The other side changes its rate only while no byte is under way, so it is that of all of these.
Result<void> PulseSimulator::take_bytes() {
  std::array<std::uint8_t, 4096> space;
  const auto size = pty_->read(space);
  if (!size) return fail(size.error());
  const std::uint32_t baud = bushd::serial::rate_of(pty_->fd());
  if (baud > 0 && baud != drive_.baud()) drive_.set_baud(now_ns(), baud);
  drive_.send(now_ns(), {space.data(), *size});
  taken_ += *size;
  return {};
}

void PulseSimulator::take_orders() {
  for (;;) {
    bushd::serial::LineOrder order;
    const ssize_t got = ::recv(client_.get(), &order, sizeof order, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got != sizeof order) {
      client_ = Descriptor();
      return;
    }
    if (order.sets != 0) drive_.set_direction(now_ns(), order.positive != 0);
    drive_.advance_to(now_ns());
    const bushd::serial::LineState state{
        .lines = drive_.lines(),
        .positive = drive_.positive() ? std::uint8_t{1} : std::uint8_t{0},
        .unused = {},
        .left = taken_ - std::min<std::uint64_t>(taken_, drive_.queued())};
    static_cast<void>(::send(client_.get(), &state, sizeof state, MSG_NOSIGNAL | MSG_DONTWAIT));
  }
}

Result<void> PulseSimulator::set_timer() {
  const std::int64_t at_ns = start_ns_ + now_ns() + kSleepNs;
  itimerspec when{};
  when.it_value.tv_sec = at_ns / bushd::sim::kNsPerSecond;
  when.it_value.tv_nsec = at_ns % bushd::sim::kNsPerSecond;
  if (::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &when, nullptr) != 0) {
    return fail(system_error("the timer cannot be set"));
  }
  return {};
}

Result<void> PulseSimulator::loop() {
  for (;;) {
    std::array<epoll_event, 5> events;
    const int count = ::epoll_wait(epoll_.get(), events.data(), std::ssize(events), -1);
    if (count < 0 && errno != EINTR) return fail(system_error("waiting failed"));
    drive_.advance_to(now_ns());
    for (int i = 0; i < count; ++i) {
      const int fd = events[static_cast<std::size_t>(i)].data.fd;
      if (fd == signals_.get()) {
        if (const auto taken = take_signal(); !taken) return taken;
      } else if (pty_ && fd == pty_->fd()) {
        if (const auto taken = take_bytes(); !taken) return taken;
      } else if (pty_ && fd == listener_.get()) {
        client_ = Descriptor(::accept4(fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
        taken_ = 0;
        if (client_.valid()) {
          if (const auto watched = watch(client_.get()); !watched) return watched;
        }
      } else if (client_.valid() && fd == client_.get()) {
        take_orders();
      } else if (pty_) {
        pty_->lift_exclusive_use();
      }
    }
    if (trace_ && trace_->error()) return fail(*trace_->error());
    if (ended_) return {};
    if (const auto set = set_timer(); !set) return set;
  }
}

Result<void> PulseSimulator::run() {
  const auto ended = loop();
  if (!trace_) return ended;
  const auto closed = trace_->close(now_ns());
  return ended ? closed : ended;
}

std::string PulseSimulator::summary() const {
  return fmt::format(
      "bushsim: mcu1: {} steps made: step0 {} (at {:+}); changes of rate or direction amid bytes: "
      "{}\n",
      drive_.steps(), drive_.steps(), drive_.position_steps(), drive_.faults());
}

}  // namespace bushsim
