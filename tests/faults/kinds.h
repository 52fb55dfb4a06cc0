// The kinds of trouble, and of commands, each with its flag and its usual rate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace bushfaults {

enum class FaultKind : std::uint8_t {
  // On the bytes between daemon and line, in either direction (sim/garbler.h, in its order).
  kBitError,
  kLostByte,
  kRepeatedByte,
  kDelayedByte,
  kNoise,
  kLostFrame,
  kTruncatedFrame,
  kRepeatedFrame,
  kDelayedFrame,
  // On larger things.
  kDeafMcu,
  kSilence,
  kUnplug,
  kPause,
  kKill,
  kReset,
  // On messages between clients and the daemon.
  kLostRequest,
  kLostAnswer,
  kNumberLeap,
  kNumberReuse,
  // None unless asked for.
  kLimitSwitch,
  kEmergencyInput,
  kTrigger,
  kSlowRequest,
  kLateRepeat,
  kStaleRepeat,
  kFlood,
  kCrowd,
  // Last, so that the others' stories stay as they are without them.
  kSecondDaemon,
  kPowerCut,
  kDiskFault,
  kEnd,
};
inline constexpr std::size_t kFaultKinds = 31;

// What clients send.
enum class CommandKind : std::uint8_t {
  kMove,
  kGroupMove,
  kRetarget,
  kStop,
  kEmergencyStop,
  kSetPosition,
  kSwitch,
  kClear,
  kAgain,
  kNonsense,
  // None unless asked for.
  kHome,
  kArm,
  kDisarm,
  kConfirm,
  kUserMove,
  kUserSet,
  kSpeed,
  kLegMove,
  kJog,
  kMotorPause,
  kSettings,
  kLine,
  kCamac,
  kPath,
  kTrajectory,
  kShutter,
  kArmLine,
  kChased,
  kMcuProgram,
};
inline constexpr std::size_t kCommandKinds = 29;

struct KindInfo {
  std::string_view name;  // as a flag and in the summary
  double per_hour;        // by default
  std::string_view what;
  double most_of_all = 0;  // of one that is 0 by default: at most, if there are all kinds
};

const KindInfo& info(FaultKind kind);
const KindInfo& info(CommandKind kind);

// Per simulated hour.
using FaultRates = std::array<double, kFaultKinds>;
using CommandRates = std::array<double, kCommandKinds>;
FaultRates usual_fault_rates();
CommandRates usual_command_rates();
// Kinds that are 0 get a rate by the seed, each a moderate one: a daemon that is always stopped
// proves nothing.
void add_all_kinds(FaultRates& faults, CommandRates& commands, std::uint64_t seed);

inline double rate(const FaultRates& rates, FaultKind kind) {
  return rates[static_cast<std::size_t>(kind)];
}
inline double rate(const CommandRates& rates, CommandKind kind) {
  return rates[static_cast<std::size_t>(kind)];
}

using FaultCounts = std::array<std::uint64_t, kFaultKinds>;
using CommandCounts = std::array<std::uint64_t, kCommandKinds>;

}  // namespace bushfaults
