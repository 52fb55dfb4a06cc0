// The words of lib/words, as requests, replies and snapshots use them, and units.
#pragma once

#include <cstdint>

#include "base/fields.h"
#include "words/amount.h"
#include "words/words.h"

namespace bushd::api {

using words::Activity;
using words::Amount;
using words::Directions;
using words::Edge;
using words::McuState;
using words::Outcome;
using words::Speed;
using words::StopMode;
using words::Trust;
using words::UserUnits;

// What a request does to motion, as far as stops are concerned: each says it by motion().
enum class Motion : std::uint8_t {
  kNone,
  kBegins,  // of the motors that it names; a stop of one of them that comes later ends it
  // Only the service in which it waits knows its motors, and asks (Precedence::overtaken).
  kBeginsByService,
  kLiftsHold,           // which a hold that comes later ends
  kLiftsEmergencyStop,  // which an emergency stop that comes later ends
  kEnds,                // of the motors that it names, or all: counts as a stop
  kEndsOnLines,         // and of those that are on one line with them
};
constexpr bool ends(Motion motion) {
  return motion == Motion::kEnds || motion == Motion::kEndsOnLines;
}

// Units of fields whose names do not tell them.
inline constexpr fields::Unit kMotorUnit{"motor's unit"};
inline constexpr fields::Unit kMotorUnitPerS{"motor's unit/s"};

using words::activity_of;
using words::directions_of;
using words::mcu_state_of;
using words::outcome_of;
using words::stop_mode_of;
using words::trust_of;
using words::word;

}  // namespace bushd::api
