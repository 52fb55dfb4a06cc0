// A bus without the daemon: one request at a time, and what is answered to it.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "bus/port/serial_port.h"
#include "engine/message.h"

namespace bushctl {

class RawBus {
 public:
  using Clock = std::chrono::steady_clock;

  // Fails if another program holds the port, as the daemon does.
  static bushd::Result<RawBus> open(const std::string& port, std::uint32_t baud);

  struct Answer {
    std::uint8_t address;
    std::vector<std::uint8_t> payload;
    std::int64_t latency_us;  // after the bus can have carried it, if it came at once
  };
  using Answers = std::vector<Answer>;
  // Sends the request, then takes answers to it until `within` has passed since the bus can have
  // carried it, or until `enough` says so. `reply_payload`: an answer's size.
  bushd::Result<Answers> ask(std::uint8_t address, std::uint8_t type,
                             std::span<const std::uint8_t> payload, std::size_t reply_payload,
                             std::chrono::microseconds within,
                             const std::function<bool(const Answers&)>& enough);

  std::chrono::microseconds bus_time(std::size_t bytes) const;

 private:
  RawBus(bushd::serial::SerialPort port, std::uint32_t baud)
      : port_(std::move(port)), baud_(baud) {}
  bushd::Result<void> read(Clock::time_point until);

  bushd::serial::SerialPort port_;
  std::uint32_t baud_;
  bushd_receiver receiver_{};
  std::vector<std::uint8_t> received_;
  std::uint8_t tag_ = 0;
};

}  // namespace bushctl
