// An input as a programme of what happens to an MCU: noise goes in as it is; frames are sent with a
// good checksum, since no fuzzer guesses one, and those that must fit the MCU's present tick,
// epoch, mark or table are made to. The pins move by themselves until the programme sets them.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "firmware/core/nvm.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {

using Bytes = std::span<const std::uint8_t>;

// Where the MCU stands, for what must fit.
struct Sight {
  std::uint8_t address;
  std::uint8_t motors;
  std::uint8_t epoch;
  std::uint32_t tick;
  std::uint32_t tick_ns;
  std::uint16_t master;  // of the last mark
  std::uint32_t sync_id;
  std::uint32_t sync_tick;
  std::uint32_t sync_ns;
};

// An MCU that it happens to: the core itself, or an image of it.
class Programmed {
 public:
  static constexpr std::uint8_t kAddress = 7;
  static constexpr std::array<std::uint8_t, BUSHD_UNIQUE_ID_SIZE> kUniqueId{'f', 'u', 'z', 'z'};

  Programmed() = default;
  Programmed(const Programmed&) = delete;
  Programmed& operator=(const Programmed&) = delete;
  virtual ~Programmed() = default;

  virtual Sight sight() = 0;
  // The CRC of the table that is there; 0: none.
  virtual std::uint32_t table_crc(std::uint8_t bank) = 0;

  virtual void begin() = 0;  // the first boot; before all else
  virtual void pass() = 0;   // of a tick
  // Bytes come; what they ask for may be left for later.
  virtual void feed(Bytes bytes) = 0;
  // The master counts its frames in their sequences; `later` is how far this one is off.
  virtual void frame(std::uint8_t address, std::uint8_t type, Bytes payload,
                     std::uint8_t later = 0) = 0;
  virtual void set_time(std::uint16_t share) = 0;
  virtual void set_pins(std::uint16_t motors, std::uint8_t system, std::uint16_t current) = 0;
  // At most a tick after the edge; only if one is waited for.
  virtual void trigger(std::int16_t share) = 0;
  virtual void sample(std::uint16_t share, std::uint16_t current) = 0;
  // What the port does while nothing else is to do.
  virtual void work(unsigned pieces) = 0;
  // All that the port keeps comes back.
  virtual void reset() = 0;
  // In the end.
  virtual void check_answers() = 0;

  // Pins that come and go, every few ticks, until the programme sets them.
  static bushd_inputs moving_pins(std::uint32_t ticks) {
    const std::uint32_t mixed = ticks / 4 * 2654435761u;
    return {static_cast<std::uint16_t>(mixed >> 22), static_cast<std::uint8_t>(mixed >> 9 & 1)};
  }
};

enum class Op : std::uint8_t {
  kNoise,       // count, bytes
  kTicksPass,   // count
  kTimeInTick,  // u16, share of the tick
  kFrame,       // flag: broadcast; type, how much later than the next sequence, count, payload
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
void run(Programmed& mcu, Input input, const OwnOps& own = {});

}  // namespace bushd::fuzz
