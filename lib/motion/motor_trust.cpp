// What a motor's position is worth.
#include <cstdlib>
#include <string>
#include <utility>

#include "motion/motor.h"

namespace bushd::motion {

void Motor::position_is_known() {
  confirmed_ = true;
  uncertain_reason_.reset();
  restored_reason_.reset();
}

void Motor::position_is_restored(std::string reason) {
  confirmed_ = true;
  uncertain_reason_.reset();
  restored_reason_ = std::move(reason);
}

void Motor::position_is_uncertain(std::string reason) {
  restored_reason_.reset();
  uncertain_reason_ = std::move(reason);
}

void Motor::position_is_unconfirmed() {
  position_is_known();
  confirmed_ = false;
}

PositionTrust Motor::trust(std::optional<std::uint16_t> boot_number) const {
  using words::Trust;
  const std::string mcu = "MCU " + setup_.mcu;
  if (!boot_number_) return {Trust::kUnknown, mcu + " has not reported where it stands yet"};
  if (boot_number && *boot_number != *boot_number_) {
    std::string at = std::to_string(position_);
    if (setup_.coordinates.has_unit()) at += " (" + setup_.coordinates.text(position_) + ")";
    return {Trust::kUnknown, mcu + " restarted; before, it was heard at " + at};
  }
  if (restoring_) return {Trust::kUnknown, "its position is being restored"};
  if (lost_) {
    std::string reason = lost_->in_motion ? mcu + " was lost while it moved, so it may have run on"
                                          : mcu + " is out of reach; it rested when it was heard";
    if (uncertain_reason_) reason += "; besides, " + *uncertain_reason_;
    return {Trust::kStale, std::move(reason), lost_->heard_utime_us};
  }
  if (uncertain_reason_) return {Trust::kUncertain, *uncertain_reason_};
  if (!confirmed_) {
    return {Trust::kUncertain, "it has been neither set nor homed since this daemon started"};
  }
  if (restored_reason_) return {Trust::kRestored, *restored_reason_};
  return {Trust::kKnown, {}};
}

// MCUs count in 32 bits, and go on at the other end: no motor makes so many steps between two
// reports. Nor may it stand beyond what can be set.
void Motor::follow_count(std::int64_t before) {
  if (std::abs(position_ - before) <= kMaxPosition && position_ >= -kMaxPosition) return;
  uncertain_reason_ = "MCU " + setup_.mcu + " has moved it from " + std::to_string(before) +
                      " beyond +-" + std::to_string(kMaxPosition) +
                      " steps, where no more are counted";
}

}  // namespace bushd::motion
