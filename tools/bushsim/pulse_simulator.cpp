#include "pulse_simulator.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <iterator>

#include "bus/port/any_rate.h"
#include "bus/port/line_socket.h"

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;
using bushd::sim::TimeNs;

constexpr std::uint8_t kAddress = 1;
// Edges are exact whenever they are looked at; waking up serves to write them down.
constexpr TimeNs kSleepNs = 20'000'000;

}  // namespace

PulseSimulator::PulseSimulator(const Options& options, Waiter waiter,
                               std::unique_ptr<bushd::sim::VcdWriter> trace)
    : waiter_(std::move(waiter)),
      links_(options.links),
      trace_(std::move(trace)),
      drive_(trace_.get()),
      positive_off_(options.setup.positive_off) {
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
  const std::int64_t start_ns = monotonic_ns();
  std::unique_ptr<bushd::sim::VcdWriter> trace;
  if (!options.trace.empty()) {
    // By it traces of two ports can be laid side by side.
    auto created =
        bushd::sim::VcdWriter::create(options.trace, std::array{kAddress}, {},
                                      fmt::format("time 0 is {} ns of CLOCK_MONOTONIC", start_ns));
    if (!created) return fail(created.error());
    trace = std::move(*created);
  }
  auto waiter = Waiter::create();
  if (!waiter) return fail(waiter.error());
  std::unique_ptr<PulseSimulator> simulator(
      new PulseSimulator(options, std::move(*waiter), std::move(trace)));
  simulator->start_ns_ = start_ns;
  if (const auto plugged = simulator->plug_in(); !plugged) return fail(plugged.error());
  return simulator;
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
  return {};
}

void PulseSimulator::unplug() {
  drive_.break_off(now_ns());
  pty_.reset();
  client_ = Descriptor();
  listener_ = Descriptor();
  ::unlink(socket_path_.c_str());
}

Result<void> PulseSimulator::take_signals() {
  while (const auto signal = waiter_.signal()) {
    if (*signal == SIGRTMIN) continue;  // no trigger input
    if (*signal == SIGUSR1) {
      if (pty_) unplug();
    } else if (*signal == SIGUSR2) {
      if (const auto plugged = plug_in(); !plugged) return plugged;
    } else {
      ended_ = true;
    }
  }
  return {};
}

TimeNs PulseSimulator::now_ns() const {
  return monotonic_ns() - start_ns_;
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
  if (*size == 0) pty_->lift_exclusive_use();
  return {};
}

void PulseSimulator::take_client() {
  const int client = ::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (client < 0) return;
  client_ = Descriptor(client);
  taken_ = 0;
}

void PulseSimulator::take_orders() {
  while (client_.valid()) {
    bushd::serial::LineOrder order;
    const ssize_t got = ::recv(client_.get(), &order, sizeof order, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got != sizeof order) {
      client_ = Descriptor();
      return;
    }
    if (order.sets != 0) drive_.set_direction(now_ns(), (order.direction_on != 0) != positive_off_);
    drive_.advance_to(now_ns());
    const bushd::serial::LineState state{
        .lines = drive_.lines(),
        .direction_on = drive_.positive() != positive_off_ ? std::uint8_t{1} : std::uint8_t{0},
        .unused = {},
        .left = taken_ - std::min<std::uint64_t>(taken_, drive_.queued())};
    static_cast<void>(::send(client_.get(), &state, sizeof state, MSG_NOSIGNAL | MSG_DONTWAIT));
  }
}

Result<void> PulseSimulator::loop() {
  while (!ended_) {
    const auto waited =
        waiter_.wait({pty_ ? pty_->fd() : -1, listener_.get(), client_.get()}, kSleepNs);
    if (!waited) return fail(waited.error());
    drive_.advance_to(now_ns());
    if (const auto taken = take_signals(); !taken) return taken;
    if (pty_) {
      take_client();  // whose bytes are counted from now on
      if (const auto taken = take_bytes(); !taken) return taken;
      take_orders();
    }
    if (trace_ && trace_->error()) return fail(*trace_->error());
  }
  return {};
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
