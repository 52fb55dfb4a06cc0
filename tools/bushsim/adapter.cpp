#include "adapter.h"

#include <cmath>
#include <limits>
#include <utility>

namespace bushsim {

using bushd::sim::Random;
using bushd::sim::TimeNs;

namespace {

constexpr std::uint64_t kDataBits = 8;
constexpr std::uint32_t kToLine = 1;  // streams of randomness
constexpr std::uint32_t kFromLine = 2;

}  // namespace

Adapter::Adapter(const AdapterOptions& options)
    : options_(options),
      to_line_(direction(kToLine)),
      from_line_(direction(kFromLine)),
      timer_ns_(options.latency_ns) {}

Adapter::Direction Adapter::direction(std::uint32_t stream) const {
  Direction made{Random(options_.seed, stream), 0};
  made.right_bits = run_of_right_bits(made.random);
  return made;
}

// Bits before one that comes with probability p are distributed geometrically: the whole part of an
// exponentially distributed number with the mean -1 / ln(1 - p).
std::uint64_t Adapter::run_of_right_bits(Random& random) const {
  if (options_.bit_error_rate <= 0) return std::numeric_limits<std::uint64_t>::max();
  return static_cast<std::uint64_t>(random.wait(-1 / std::log1p(-options_.bit_error_rate)));
}

void Adapter::flip_bits(Direction& direction, std::span<std::uint8_t> bytes) {
  if (options_.bit_error_rate <= 0) return;
  for (std::uint8_t& byte : bytes) {
    std::uint64_t bit = direction.right_bits;
    while (bit < kDataBits) {
      byte = static_cast<std::uint8_t>(byte ^ (1u << bit));
      ++flipped_bits_;
      bit += 1 + run_of_right_bits(direction.random);
    }
    direction.right_bits = bit - kDataBits;
  }
}

void Adapter::send_packet(TimeNs time_ns) {
  sent_.insert(sent_.end(), held_.begin(), held_.end());
  held_.clear();
  timer_ns_ = time_ns + options_.latency_ns;
}

void Adapter::run_timer(TimeNs until_ns) {
  if (options_.latency_ns == 0 || timer_ns_ > until_ns) return;
  send_packet(timer_ns_);
  // The packets that follow it are empty.
  if (timer_ns_ > until_ns) return;
  timer_ns_ += ((until_ns - timer_ns_) / options_.latency_ns + 1) * options_.latency_ns;
}

void Adapter::take_from_line(std::uint8_t byte, TimeNs time_ns) {
  run_timer(time_ns);
  flip_bits(from_line_, {&byte, 1});
  held_.push_back(byte);
  if (options_.latency_ns == 0 || held_.size() == kPacketBytes) send_packet(time_ns);
}

std::vector<std::uint8_t> Adapter::take_packets(TimeNs now_ns) {
  run_timer(now_ns);
  return std::exchange(sent_, {});
}

TimeNs Adapter::next_packet_ns() const {
  return held_.empty() ? bushd::sim::kNever : timer_ns_;
}

}  // namespace bushsim
