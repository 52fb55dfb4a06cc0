// An input as a programme of what happens to an MCU: noise goes in as it is; frames are sent with a
// good checksum, since no fuzzer guesses one, and those that must fit the MCU's present tick,
// epoch, mark or table are made to. The pins move by themselves until the programme sets them.
#pragma once

#include <functional>
#include <vector>

#include "fuzz/core_rig.h"

namespace bushd::fuzz {

enum class Op : std::uint8_t {
  kNoise,       // count, bytes
  kTicksPass,   // count
  kTimeInTick,  // u16, share of the tick
  kFrame,       // flag: broadcast; type, how much later than the next tag, count, payload
  kTicks,       // TICKS whose first tick and epoch count from the MCU's
  kSync,        // SYNC that follows the last mark, this far off it
  kTableEnd,    // TABLE_END with the checksum of what is there
  kTableTicks,  // TABLE_TICKS in the same way as TICKS
  kTableRun,    // TABLE_RUN, too
  kPins,        // motors, system inputs, current
  kTrigger,     // an edge at that input, this long after the tick's beginning (or before)
  kSample,      // of the supply current
  kWork,        // pieces of what a frame asks for
  kReset,       // what is kept comes back
  kCount
};

// What a target adds, numbered from kCount on.
using OwnOps = std::vector<std::function<void(Input&)>>;

// One for targets whose port keeps something: rest is long enough to write it.
inline unsigned rest_ticks(Input& input) {
  const unsigned ticks = input.u8();
  return ticks < 240 ? ticks : 64 * (ticks - 239);
}

// From the first boot on; in the end the MCU must answer.
void run(CoreRig& mcu, Input input, const OwnOps& own = {});

}  // namespace bushd::fuzz
