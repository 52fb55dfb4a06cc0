#include "bus/rs485/emergency_stop.h"

#include <algorithm>
#include <array>

namespace bushd::link {
namespace {

constexpr int kFrames = 3;
constexpr std::int64_t kRepeatUs = 20'000;
constexpr std::int64_t kLongestUs = 2'000'000;  // after this an MCU that says nothing is left alone

}  // namespace

void EmergencyStop::begin(bushd_stop_mode mode) {
  stop_ = Stop{.mode = mode, .until_us = {}};
  // One that was latched before says nothing of this one.
  for (McuRecord& mcu : mcus_) {
    constexpr unsigned kOfStops = BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_DISABLED;
    mcu.view.report.faults &= static_cast<std::uint8_t>(~kOfStops);
  }
}

bool EmergencyStop::send_due(std::int64_t now_us) {
  if (!stop_) return false;
  const bool open = std::any_of(mcus_.begin(), mcus_.end(), [this](const McuRecord& mcu) {
    return mcu.view.phase != McuPhase::kOffline && !has_obeyed(mcu.view, stop_->mode);
  });
  if (stop_->until_us && (!open || now_us >= *stop_->until_us)) {
    stop_.reset();
    return false;
  }
  if (now_us < stop_->due_us) return false;
  if (!stop_->until_us) stop_->until_us = now_us + kLongestUs;
  stop_->due_us = now_us + kRepeatUs;
  for (int i = 0; i < kFrames; ++i) {
    // An MCU that is not among those configured may have a firmware that refuses the mode, and does
    // not say so. The others have obeyed by then, and this changes nothing for them.
    const bool is_last = i + 1 == kFrames;
    const bool to_all = is_last && stop_->mode == BUSHD_STOP_DISABLE;
    const bushd_stop_mode mode = to_all ? BUSHD_STOP_IMMEDIATE : stop_->mode;
    const std::array<std::uint8_t, 1> payload = {static_cast<std::uint8_t>(mode)};
    writer_.send(now_us, kBroadcast, BUSHD_MSG_EMERGENCY, payload);
  }
  for (McuRecord& mcu : mcus_) mcu.poll_wanted |= mcu.view.phase != McuPhase::kOffline;
  return true;
}

}  // namespace bushd::link
