// Keypads of the event loop: their ports, which come and go as those of buses do.
#include <fmt/format.h>
#include <sys/epoll.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

#include "daemon/shell/event_loop.h"
#include "daemon/shell/process.h"

namespace bushd::daemon {

EventLoop::KeypadPort::KeypadPort(const config::Keypad& its_config, std::string motor,
                                  Keypad::Ask ask)
    : config(its_config), keypad(its_config, std::move(motor), std::move(ask)) {}

EventLoop::KeypadPort::~KeypadPort() = default;

void EventLoop::add_keypads() {
  for (const config::Keypad& keypad : config_.keypads) {
    keypads_.push_back(std::make_unique<KeypadPort>(
        keypad, config_[keypad.motor].name, [this](api::Asker asker, api::Request request) {
          reception_.take(std::move(asker), std::move(request), 1);
        }));
  }
}

void EventLoop::open_keypad(KeypadPort& port) {
  port.opening = true;
  port_worker_.post([this, &port, &config = port.config]() -> Worker::Completion {
    const auto opened = std::make_shared<Result<serial::SerialPort>>(
        serial::SerialPort::open_any_rate(config.port, config.baud));
    return [this, &port, opened] { keypad_opened(now_us(), port, std::move(*opened)); };
  });
}

void EventLoop::keypad_opened(std::int64_t now, KeypadPort& port,
                              Result<serial::SerialPort> opened) {
  port.opening = false;
  port.open_due_us = now + kReopenUs;
  Result<std::unique_ptr<PollSet::Watch>> watched;
  if (opened) {
    watched = poll_set_.watch(opened->fd(), PollSet::Turn::kFirst,
                              [this, &port](std::uint32_t) { handle_keypad(now_us(), port); });
  }
  if (!opened || !watched) {
    const std::string error = opened ? watched.error().text() : opened.error().text();
    if (opened) close_in_worker(std::make_shared<serial::SerialPort>(std::move(*opened)));
    if (std::exchange(port.last_error, error) == error) return;
    return log(LogLevel::kError, port.config.motor,
               fmt::format("keypad: {}; trying again twice a second", error));
  }
  port.serial = std::move(*opened);
  port.watch = std::move(*watched);
  port.last_error.clear();
  log(LogLevel::kInfo, port.config.motor,
      fmt::format("keypad: port {} opened at {} baud", port.serial->path(), port.config.baud));
  port.keypad.port_opened();
}

void EventLoop::lose_keypad(std::int64_t now, KeypadPort& port) {
  log(LogLevel::kError, port.config.motor,
      fmt::format("keypad: port {} lost: {}; trying again twice a second", port.serial->path(),
                  *port.lost));
  port.lost.reset();
  port.watch.reset();
  close_in_worker(std::make_shared<serial::SerialPort>(std::move(*port.serial)));
  port.serial.reset();
  port.open_due_us = now + kReopenUs;
  port.keypad.port_lost();
}

void EventLoop::handle_keypad(std::int64_t now, KeypadPort& port) {
  if (!port.serial || port.lost) return;
  std::vector<std::uint8_t> bytes;
  const auto read = port.serial->read(bytes);
  port.keypad.receive(now, bytes);
  if (!read) port.lost = read.error().text();
}

// After all that may have answered them.
void EventLoop::step_keypads(std::int64_t now) {
  for (const auto& port : keypads_) {
    if (port->lost) lose_keypad(now, *port);
    if (!port->serial && !port->opening && port->open_due_us <= now) open_keypad(*port);
    if (!port->serial) continue;
    port->keypad.step(now);
    const std::string shown = port->keypad.take_display();
    if (shown.empty()) continue;
    const std::vector<std::uint8_t> bytes(shown.begin(), shown.end());
    // A display that takes nothing is no reason to stop a motor; a port that is gone is.
    if (const auto written = port->serial->write(bytes); !written) {
      port->lost = written.error().text();
    }
  }
}

std::int64_t EventLoop::next_keypad_wake_us() const {
  std::int64_t wake = std::numeric_limits<std::int64_t>::max();
  for (const auto& port : keypads_) {
    if (port->lost) return 0;
    if (port->opening) continue;
    wake = std::min(wake, port->serial ? port->keypad.next_wake_us() : port->open_due_us);
  }
  return wake;
}

}  // namespace bushd::daemon
