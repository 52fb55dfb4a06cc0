#include "sim/wire.h"

#include <algorithm>
#include <cassert>

namespace bushd::sim {
namespace {

// What a receiver makes of two drivers that fight is anything; this never leaves a byte as it was.
constexpr std::uint8_t kCorruption = 0xA5;

}  // namespace

std::size_t Wire::add_talker() {
  talkers_.emplace_back();
  return talkers_.size() - 1;
}

TimeNs Wire::send(std::size_t talker, std::span<const std::uint8_t> bytes, TimeNs at_ns) {
  Talker& t = talkers_[talker];
  if (at_ns > t.free_ns) {
    t.origin_ns = t.free_ns = at_ns;
    t.bytes_since_origin = 0;
  }
  for (const std::uint8_t value : bytes) {
    // `baud` bytes take 10 s sharp: moving the origin there keeps the product small.
    if (t.bytes_since_origin == baud_) {
      t.origin_ns += kBitsPerByte * kNsPerSecond;
      t.bytes_since_origin = 0;
    }
    ++t.bytes_since_origin;
    const TimeNs end_ns = t.origin_ns + t.bytes_since_origin * kBitsPerByte * kNsPerSecond / baud_;
    t.waiting.push_back({t.free_ns, end_ns, value, false});
    t.free_ns = end_ns;
  }
  find_next();
  return t.free_ns;
}

void Wire::silence(std::size_t talker, TimeNs now_ns) {
  Talker& t = talkers_[talker];
  while (!t.waiting.empty() && t.waiting.back().start_ns >= now_ns) t.waiting.pop_back();
  if (!t.waiting.empty()) t.waiting.front().broken_off = true;
  t.free_ns = t.waiting.empty() ? now_ns : t.waiting.back().end_ns;
  t.origin_ns = t.free_ns;
  t.bytes_since_origin = 0;
  find_next();
}

// A byte that is looked at ends now, so whatever could overlap it is the one taken last or the one
// on the line: both bytes are of the same length.
const Wire::Byte* Wire::overlap(const Talker& talker, TimeNs start_ns, TimeNs end_ns) {
  if (talker.last.end_ns > start_ns && talker.last.start_ns < end_ns) return &talker.last;
  if (talker.waiting.empty()) return nullptr;
  const Byte& present = talker.waiting.front();
  return present.start_ns < end_ns && present.end_ns > start_ns ? &present : nullptr;
}

WireByte Wire::take() {
  assert(next_end_ns_ != kNever);
  Talker& from = talkers_[next_talker_];
  const Byte byte = from.waiting.front();
  from.waiting.pop_front();
  from.last = byte;
  WireByte taken{byte.start_ns, byte.end_ns, byte.value, next_talker_, byte.broken_off, {}};
  for (std::size_t i = 0; i < talkers_.size(); ++i) {
    if (i == next_talker_) continue;
    const Byte* other = overlap(talkers_[i], byte.start_ns, byte.end_ns);
    if (other == nullptr) continue;
    taken.corrupted = true;
    const TimeNs began_ns = std::max(byte.start_ns, other->start_ns);
    if (began_ns > collision_until_ns_) {
      const bool first = byte.start_ns <= other->start_ns;
      taken.collision = Collision{began_ns, {first ? next_talker_ : i, first ? i : next_talker_}};
    }
    collision_until_ns_ = std::max({collision_until_ns_, byte.end_ns, other->end_ns});
  }
  if (taken.corrupted) taken.value ^= kCorruption;
  find_next();
  return taken;
}

bool Wire::drives(std::size_t talker, TimeNs from_ns, TimeNs until_ns) const {
  return overlap(talkers_[talker], from_ns, until_ns) != nullptr;
}

TimeNs Wire::busy_until_ns() const {
  TimeNs until_ns = 0;
  for (const Talker& talker : talkers_) until_ns = std::max(until_ns, talker.free_ns);
  return until_ns;
}

void Wire::find_next() {
  next_end_ns_ = kNever;
  for (std::size_t i = 0; i < talkers_.size(); ++i) {
    if (talkers_[i].waiting.empty() || talkers_[i].waiting.front().end_ns >= next_end_ns_) continue;
    next_end_ns_ = talkers_[i].waiting.front().end_ns;
    next_talker_ = i;
  }
}

}  // namespace bushd::sim
