// The words of lib/words, as requests, replies and snapshots use them, and units.
#pragma once

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
