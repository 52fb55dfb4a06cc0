// Ports of buses: opened, searched among the matches of a pattern, read, written and lost.
#include <fmt/format.h>
#include <sys/epoll.h>

#include <memory>
#include <utility>

#include "daemon/shell/event_loop.h"
#include "daemon/shell/process.h"

namespace bushd::daemon {

EventLoop::Port::Port(PortSearch its_search) : search(std::move(its_search)) {}

EventLoop::Port::Port(Port&&) noexcept = default;

EventLoop::Port::~Port() = default;

// Drivers may take their time to open and to close a port.
void EventLoop::open_due_ports(std::int64_t now) {
  for (const BusId bus : ports_.ids()) {
    Port& port = ports_[bus];
    if (port.serial || port.opening || port.open_due_us > now) continue;
    port.opening = true;
    port_worker_.post([this, bus, order = port.search.first(),
                       in_use = ports_in_use(bus)]() -> Worker::Completion {
      const auto opened = std::make_shared<Result<std::unique_ptr<BusPort>>>(
          open_first_port(config_[bus], order, in_use));
      return [this, bus, opened] { port_opened(now_us(), bus, std::move(*opened)); };
    });
  }
}

// What is open stays open until another match has been opened: with no other, nothing is disturbed.
void EventLoop::search_ports(std::int64_t now) {
  if (shut_down_by_us_) return;
  for (const BusId bus : ports_.ids()) {
    Port& port = ports_[bus];
    if (!port.serial || port.opening || port.lost) continue;
    if (core_.heard(bus)) port.search.found();
    if (!port.search.due(now)) continue;
    port.opening = true;
    port_worker_.post([this, bus, order = port.search.next(),
                       in_use = ports_in_use(bus)]() -> Worker::Completion {
      const auto opened = std::make_shared<Result<std::unique_ptr<BusPort>>>(
          open_first_port(config_[bus], order, in_use));
      return [this, bus, opened] { next_port_opened(now_us(), bus, std::move(*opened)); };
    });
  }
}

void EventLoop::next_port_opened(std::int64_t now, BusId bus,
                                 Result<std::unique_ptr<BusPort>> opened) {
  Port& port = ports_[bus];
  port.opening = false;
  if (!opened) return port.search.no_other(now);
  if (!port.serial || port.lost || core_.heard(bus)) {
    return close_in_worker(std::shared_ptr<BusPort>(std::move(*opened)));
  }
  const std::string cause =
      fmt::format("{}: nothing of this bus has answered within {:g} s", port.serial->path(),
                  static_cast<double>(port.search.time_us()) * 1e-6);
  const std::string text =
      fmt::format("bus {}: {}; trying {}", config_[bus].name, cause, (*opened)->path());
  if (port.search.is_news(text)) log(LogLevel::kWarning, {}, text);
  release_port(bus);
  core_.port_lost(now, bus, "port " + cause);
  port_opened(now, bus, std::move(opened));
}

// The ports of buses, and of keypads.
std::vector<PortInUse> EventLoop::ports_in_use(BusId asking) const {
  std::vector<PortInUse> in_use;
  for (const BusId bus : ports_.ids()) {
    if (bus == asking || !ports_[bus].serial) continue;
    in_use.push_back({.path = ports_[bus].serial->path(), .user = "bus " + config_[bus].name});
  }
  for (const auto& keypad : keypads_) {
    if (!keypad->serial) continue;
    in_use.push_back({.path = keypad->serial->path(), .user = "a keypad"});
  }
  return in_use;
}

void EventLoop::port_opened(std::int64_t now, BusId bus, Result<std::unique_ptr<BusPort>> opened) {
  Port& port = ports_[bus];
  const config::Bus& config = config_[bus];
  port.opening = false;
  port.open_due_us = now + kReopenUs;
  Result<std::unique_ptr<PollSet::Watch>> watched;
  if (opened) {
    watched =
        poll_set_.watch((*opened)->fd(), PollSet::Turn::kUsual,
                        [this, bus](std::uint32_t events) { handle_port(now_us(), bus, events); });
  }
  if (!opened || !watched) {
    const std::string error = opened ? watched.error().text() : opened.error().text();
    if (opened) close_in_worker(std::shared_ptr<BusPort>(std::move(*opened)));
    if (error != port.last_error) {
      log(LogLevel::kError, {},
          fmt::format("bus {}: {}; trying again twice a second", config.name, error));
      port.last_error = error;
      core_.port_lost(now, bus, "port " + error);
    }
    return;
  }
  port.serial = std::move(*opened);
  port.watch = std::move(*watched);
  port.last_error.clear();
  port.search.opened(now, port.serial->path());
  const std::string text = fmt::format("bus {}: port {} opened {}", config.name,
                                       port.serial->path(), port.serial->text());
  if (port.search.is_news(text)) log(LogLevel::kInfo, {}, text);
  core_.port_opened(now, bus, port.serial->path());
}

void EventLoop::lose_port(std::int64_t now, BusId bus, const std::string& cause) {
  Port& port = ports_[bus];
  if (!port.serial) return;
  const config::Bus& config = config_[bus];
  const std::string path = port.serial->path();
  release_port(bus);
  port.search.lost();
  port.open_due_us = now + kReopenUs;
  port.last_error = path + ": " + cause;
  log(LogLevel::kError, {},
      fmt::format("bus {}: port {} lost: {}; trying again twice a second", config.name, path,
                  cause));
  core_.port_lost(now, bus, "port " + port.last_error);
}

void EventLoop::release_port(BusId bus) {
  Port& port = ports_[bus];
  port.watch.reset();
  close_in_worker(std::shared_ptr<BusPort>(std::move(port.serial)));
  port.status.reset();
}

void EventLoop::close_in_worker(std::shared_ptr<void> port) {
  port_worker_.post([port = std::move(port)]() mutable -> Worker::Completion {
    port.reset();
    return [] {};
  });
}

// What is lost is given up in the loop: its watch cannot go while it is being handled.
void EventLoop::handle_port(std::int64_t now, BusId bus, std::uint32_t events) {
  if (!ports_[bus].serial) return;
  BusPort& serial = *ports_[bus].serial;
  if (events & EPOLLIN) {
    received_.clear();
    const auto read = serial.read(received_);
    if (!received_.empty()) core_.receive(now, bus, received_);
    if (!read) ports_[bus].lost = read.error().text();
  } else if (events & (EPOLLHUP | EPOLLERR)) {
    ports_[bus].lost = "hung up";
  }
  if (events & EPOLLOUT) {
    const auto flushed = serial.flush();
    if (!flushed) ports_[bus].lost = flushed.error().text();
  }
}

// A port whose answers decide nothing yet is not listened to: each wakes the daemon, and all are
// read at once when the last of them may be there.
void EventLoop::update_interest(std::int64_t now, BusId bus) {
  Port& port = ports_[bus];
  if (!port.serial) return;
  const std::int64_t from_us = core_.listen_from_us(bus);
  port.listen_us = from_us > now ? from_us : 0;
  std::uint32_t events = 0;
  if (port.listen_us == 0) events |= EPOLLIN;
  if (port.serial->wants_to_write()) events |= EPOLLOUT;
  port.watch->await(events);
}

void EventLoop::send(BusId bus, std::span<const std::uint8_t> bytes) {
  if (!ports_[bus].serial) return;
  if (const auto written = ports_[bus].serial->write(bytes); !written) {
    ports_[bus].lost = written.error().text();
  }
}

void EventLoop::pulse(BusId bus, const link::PulseOrder& order) {
  if (!ports_[bus].serial) return;
  const auto status = ports_[bus].serial->carry_out(order);
  if (!status) ports_[bus].lost = status.error().text();
  if (status) ports_[bus].status = *status;
}

}  // namespace bushd::daemon
