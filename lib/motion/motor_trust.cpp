#include "motion/motor_trust.h"

#include <string>
#include <utility>

namespace bushd::motion {

void MotorTrust::is_known() {
  confirmed_ = true;
  uncertain_reason_.reset();
  restored_reason_.reset();
}

void MotorTrust::is_restored(std::string reason) {
  confirmed_ = true;
  uncertain_reason_.reset();
  restored_reason_ = std::move(reason);
}

void MotorTrust::is_uncertain(std::string reason) {
  restored_reason_.reset();
  uncertain_reason_ = std::move(reason);
}

void MotorTrust::is_unconfirmed() {
  is_known();
  confirmed_ = false;
}

void MotorTrust::goes_online(std::uint16_t boot_number) {
  boot_number_ = boot_number;
  lost_.reset();
}

PositionTrust MotorTrust::judged(std::optional<std::uint16_t> boot_number,
                                 std::int64_t position_steps,
                                 const units::Coordinates& coordinates) const {
  using words::Trust;
  if (!boot_number_) {
    return {Trust::kUnknown, "MCU " + mcu_ + " has not reported where it stands yet"};
  }
  if (boot_number && *boot_number != *boot_number_) {
    std::string at = std::to_string(position_steps);
    if (coordinates.has_unit()) at += " (" + coordinates.text(position_steps) + ")";
    return {Trust::kUnknown, "MCU " + mcu_ + " restarted; before, it was heard at " + at};
  }
  if (restoring_) return {Trust::kUnknown, "its position is being restored"};
  if (lost_) {
    std::string reason = "MCU " + mcu_ +
                         (lost_->in_motion ? " was lost while it moved, so it may have run on"
                                           : " is out of reach; it rested when it was heard");
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

}  // namespace bushd::motion
