// What a kept position is worth when its MCU is connected again.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "state/record.h"

namespace bushd::state {

// A motor, and what is kept of it.
struct Owner {
  std::string motor{};
  Record record{};
};

// What is seen of a motor when its MCU goes online.
struct Seen {
  std::string mcu{};  // for texts
  std::string unique_id{};
  std::uint16_t boot_number = 0;
  std::uint8_t output = 0;
  std::string steps_per_unit{};
  std::int64_t steps = 0;  // as the MCU counts them now
  // Whose position this output's counter was until now, if that was another motor.
  std::optional<Owner> before{};
  // The kept steps, or those of the motor before, in the motor's unit; "" if there is none.
  std::string position_text{};
  bool local = false;  // people may have moved it unseen
  // It stands where a switch stops it immediately: nobody saw from which speed.
  bool may_have_overrun = false;
};

struct Verdict {
  Trust trust = Trust::kUnconfirmed;
  std::string reason{};  // of kRestored and kUncertain
  // The MCU's counter has to be set to this before anything moves.
  std::optional<std::int64_t> set_steps{};
};

// Same MCU and boot: its counter counts. Booted anew: the motor stands where it stood, if it stood.
// Everything else is uncertain, and the reason says what was known last, and when. An output that
// was another motor's may have been given another name, or another cable: its counter goes on, and
// people have to say whether it is this motor's position.
Verdict on_connecting(const Kept& kept, const Seen& seen);

// "2026-11-20 17:03:12 UTC"
std::string time_text(std::int64_t utime_us);

}  // namespace bushd::state
