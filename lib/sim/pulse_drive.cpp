#include "sim/pulse_drive.h"

#include <algorithm>

namespace bushd::sim {
namespace {}  // namespace

void PulseDrive::attach_switch(std::uint8_t line, const SwitchOptions& options) {
  switches_.push_back({line, Switch(options)});
}

void PulseDrive::set_baud(TimeNs now_ns, std::uint32_t baud) {
  advance_to(now_ns);
  if (!ends_ns_.empty()) ++faults_;
  baud_ = baud;
}

void PulseDrive::set_direction(TimeNs now_ns, bool positive) {
  advance_to(now_ns);
  if (positive == positive_) return;
  if (!ends_ns_.empty()) ++faults_;
  positive_ = positive;
  if (sink_ != nullptr) sink_->edge({now_ns, mcu_, Signal::kDir, 0, positive});
}

void PulseDrive::send(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  advance_to(now_ns);
  for (const std::uint8_t value : bytes) byte(std::max(line_free_ns_, now_ns), value);
}

// Times are rounded to whole ns: an interval is exact to one.
void PulseDrive::byte(TimeNs from_ns, std::uint8_t value) {
  const unsigned frame = 0x200u | static_cast<unsigned>(value) << 1;  // stop, data, start
  bool step = false;  // the line is high before the start bit
  for (unsigned bit = 0; bit < 10; ++bit) {
    const bool low = (frame >> bit & 1) == 0;
    if (low == step) continue;
    step = low;
    levels_.push_back({from_ns + (bit * kNsPerSecond + baud_ - 1) / baud_, step});
  }
  line_free_ns_ = from_ns + (10 * kNsPerSecond + baud_ - 1) / baud_;
  ends_ns_.push_back(line_free_ns_);
}

void PulseDrive::break_off(TimeNs now_ns) {
  advance_to(now_ns);
  const bool high = !levels_.empty() && !levels_.front().step;
  levels_.clear();
  ends_ns_.clear();
  line_free_ns_ = now_ns;
  if (high) levels_.push_back({now_ns, false});
}

void PulseDrive::advance_to(TimeNs now_ns) {
  now_ns_ = std::max(now_ns, now_ns_);
  while (!levels_.empty() && levels_.front().time_ns <= now_ns_) {
    const Level level = levels_.front();
    levels_.pop_front();
    if (sink_ != nullptr) sink_->edge({level.time_ns, mcu_, Signal::kStep, 0, level.step});
    if (!level.step) continue;
    position_ += positive_ ? 1 : -1;
    ++steps_;
    if (keeps_steps) step_times_.push_back(level.time_ns);
  }
  while (!ends_ns_.empty() && ends_ns_.front() <= now_ns_) ends_ns_.pop_front();
  if (sink_ != nullptr) sink_->settled(now_ns_);
}

std::uint8_t PulseDrive::lines() {
  unsigned lines = by_hand_;
  for (AtLine& one : switches_) {
    if (one.what.read(now_ns_, position_)) lines |= 1u << one.line;
  }
  return static_cast<std::uint8_t>(lines);
}

}  // namespace bushd::sim
