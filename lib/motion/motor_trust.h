// What the position of a motor is worth, and why it is not known where it is not. Reasons come from
// what has happened: in motor.cpp and motor_ends.cpp, and in the services of the daemon.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "base/units/coordinates.h"
#include "words/words.h"

namespace bushd::motion {

struct PositionTrust {
  words::Trust trust;
  std::string reason;                            // why it is not known; "" while it is
  std::optional<std::int64_t> heard_utime_us{};  // if stale
};

class MotorTrust {
 public:
  // `mcu`: its name, for texts.
  explicit MotorTrust(std::string mcu) : mcu_(std::move(mcu)) {}

  // `boot_number`: of the MCU now. `position_steps`: as reported last.
  PositionTrust judged(std::optional<std::uint16_t> boot_number, std::int64_t position_steps,
                       const units::Coordinates& coordinates) const;
  // The MCU's boot that the position belongs to; nothing before the first report.
  std::optional<std::uint16_t> boot_number() const { return boot_number_; }
  // Why steps may be lost, so that it may not move. Nothing: none are, as far as this daemon knows.
  const std::optional<std::string>& uncertain_reason() const { return uncertain_reason_; }
  // Somebody has said where it stands, in this run of the daemon or as was kept.
  bool confirmed() const { return confirmed_; }
  // Its MCU is offline, and was lost while it moved, so it may have run on.
  bool lost_in_motion() const { return lost_ && lost_->in_motion; }
  // Since then its MCU has lost power, and it stood.
  const std::optional<std::string>& restored_reason() const { return restored_reason_; }

  void is_known();
  // What was kept from before the MCU, or the daemon, was started.
  void is_restored(std::string reason);
  void is_uncertain(std::string reason);
  void is_unconfirmed();  // nobody has said where it stands
  // As is_uncertain, and what was restored stays restored besides.
  void lose_steps(std::string reason) { uncertain_reason_ = std::move(reason); }
  // The MCU's counter is being set to what was kept: until then it is not its position.
  void restoring(bool now) { restoring_ = now; }

  // Its MCU reports: in this boot, or no more.
  void goes_online(std::uint16_t boot_number);
  // `heard_utime_us`: when its MCU reported last.
  void goes_offline(std::int64_t heard_utime_us, bool in_motion) {
    lost_ = Lost{.heard_utime_us = heard_utime_us, .in_motion = in_motion};
  }

 private:
  struct Lost {
    std::int64_t heard_utime_us;
    bool in_motion;
  };

  std::string mcu_;
  std::optional<std::uint16_t> boot_number_;
  // Somebody has said where it stands, or its switch has. What an earlier daemon was told, and
  // whether steps were lost since, this one does not know.
  bool confirmed_ = false;
  std::optional<Lost> lost_;  // its MCU is offline
  std::optional<std::string> uncertain_reason_;
  std::optional<std::string> restored_reason_;
  bool restoring_ = false;
};

}  // namespace bushd::motion
