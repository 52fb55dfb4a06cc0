#include "raw_bus.h"

#include <fmt/format.h>
#include <poll.h>

#include <array>

namespace bushctl {

using bushd::fail;
using bushd::Result;
using std::chrono::microseconds;

Result<RawBus> RawBus::open(const std::string& port, std::uint32_t baud) {
  auto opened = bushd::serial::SerialPort::open(port, baud);
  if (!opened) return fail(opened.error());
  return RawBus(std::move(*opened), baud);
}

microseconds RawBus::bus_time(std::size_t bytes) const {
  return microseconds(static_cast<std::int64_t>(bytes) * 10'000'000 / baud_ + 1);
}

Result<void> RawBus::read(Clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::nanoseconds>(until - Clock::now()).count();
  const timespec wait = {.tv_sec = std::max<std::int64_t>(left, 0) / 1'000'000'000,
                         .tv_nsec = std::max<std::int64_t>(left, 0) % 1'000'000'000};
  const short events = static_cast<short>(POLLIN | (port_.wants_to_write() ? POLLOUT : 0));
  pollfd polled{.fd = port_.fd(), .events = events, .revents = 0};
  if (::ppoll(&polled, 1, &wait, nullptr) <= 0) return {};
  if ((polled.revents & POLLOUT) != 0) {
    if (auto flushed = port_.flush(); !flushed) return flushed;
  }
  if ((polled.revents & (POLLIN | POLLHUP | POLLERR)) == 0) return {};
  return port_.read(received_);
}

Result<std::vector<RawBus::Answer>> RawBus::ask(
    std::uint8_t address, std::uint8_t type, std::span<const std::uint8_t> payload,
    std::size_t reply_payload, microseconds within,
    const std::function<bool(const std::vector<Answer>&)>& enough) {
  // A delimiter first: it ends whatever noise receivers took for the beginning of a frame.
  std::array<std::uint8_t, 1 + BUSHD_FRAME_MAX_WIRE> wire{};
  const std::size_t size =
      1 + bushd_frame_encode(address, type, ++tag_, payload.data(), payload.size(), &wire[1]);
  const Clock::time_point sent = Clock::now() + bus_time(size);
  const microseconds reply_time = bus_time(reply_payload + BUSHD_FRAME_OVERHEAD);
  if (auto written = port_.write({wire.data(), size}); !written) return fail(written.error());
  std::vector<Answer> answers;
  const Clock::time_point end = sent + within;
  while (Clock::now() < end && !enough(answers)) {
    received_.clear();
    if (auto heard = read(end); !heard) return fail(heard.error());
    const Clock::time_point now = Clock::now();
    for (const std::uint8_t byte : received_) {
      bushd_frame frame;
      if (bushd_receive_byte(&receiver_, byte, &frame) != BUSHD_RECEIVE_FRAME) continue;
      if (frame.sequence != tag_ || frame.type != (type | BUSHD_TYPE_REPLY)) continue;
      const auto late = std::chrono::duration_cast<microseconds>(now - sent - reply_time).count();
      answers.push_back({.address = frame.address,
                         .payload = {frame.payload, frame.payload + frame.payload_size},
                         .latency_us = std::max<std::int64_t>(late, 0)});
    }
  }
  return answers;
}

}  // namespace bushctl
