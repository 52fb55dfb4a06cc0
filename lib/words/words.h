// The daemon's own enumerations, and the words for them that clients see. Each exists once: motors,
// core, front ends and log use these.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace bushd::words {

// How a request ended. Of a request for several motors it is the worst of theirs, in this order.
enum class Outcome {
  kDone,     // of requests that are not moves
  kReached,  // the MCU has run the last tick and the motor stands at the target
  kStopped,  // ramped down on request, given a new target, or disarmed
  kLimit,    // a limit switch stopped it, or a jog has come to its soft limit
  kLink,     // the MCU was lost or ramped down by itself; the position is the last one known
  kFault     // the MCU counted otherwise than the table says, or did not do what was asked
};

// What a motor does.
enum class Activity {
  kResting,
  kMoving,
  kArming,  // at rest, its MCU has not yet confirmed that it waits for the trigger
  kArmed,   // at rest, waits for the trigger of its MCU
  kHoming,  // or waits until the MCU has homed another one
  kLocal    // moved by the local inputs of its MCU, or by another master of its line
};

// How far a position can be relied on.
enum class Trust {
  kUnknown,   // its MCU has not reported since it booted: there is no number
  kKnown,     // the MCU has counted every step since somebody said where the motor stands
  kRestored,  // as it was when the MCU lost power, at rest; nobody has looked since
  kStale,     // as heard last from an MCU that is offline: it may have run on, or lost power
  kUncertain  // steps may be lost, or nobody has said where it stands
};

enum class McuState { kOffline, kBusy, kReady, kRunning, kFault };

enum class StopMode {
  kRamp,       // by the decelerating side of the table
  kImmediate,  // no further step; a motor at speed may overrun
  kDisable     // the same, and drivers are disabled at once
};

enum class Edge {
  kRising,  // the input becomes active
  kFalling
};

// Directions of motion, one, both or none.
struct Directions {
  bool positive = false;
  bool negative = false;
  bool any() const { return positive || negative; }
  friend bool operator==(const Directions&, const Directions&) = default;
};

// The words are lower case and stable: scripts compare them.
std::string_view word(Outcome outcome);        // done reached stopped limit link fault
std::string_view word(Activity activity);      // rest move armed home local
std::string_view word(Trust trust);            // unknown known restored stale uncertain
std::string_view word(McuState state);         // OFFLINE BUSY READY RUN FAULT
std::string_view word(StopMode mode);          // ramp immediate disable
std::string_view word(Edge edge);              // rising falling
std::string_view word(Directions directions);  // "" positive negative both

// Nothing for a word that is none of these.
std::optional<Outcome> outcome_of(std::string_view word);
std::optional<Activity> activity_of(std::string_view word);
std::optional<Trust> trust_of(std::string_view word);
std::optional<McuState> mcu_state_of(std::string_view word);
std::optional<StopMode> stop_mode_of(std::string_view word);
std::optional<Directions> directions_of(std::string_view word);

}  // namespace bushd::words
