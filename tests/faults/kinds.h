// The kinds of trouble, and of commands, each with its flag and its usual rate: a row of the table
// behind each enumeration, in its order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace bushfaults {

struct KindInfo {
  std::string_view name;  // as a flag and in the summary
  double per_hour;        // by default
  std::string_view what;
  double most_of_all = 0;  // of one that is 0 by default: at most, if there are all kinds
};

// What a line sees often is frequent, what a lab sees now and then is rarer; but rare enough, all
// of it, that moves go well in between: a daemon that is always down proves nothing.

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
inline constexpr auto kFaults = std::to_array<KindInfo>({
    {"bit-errors", 9000, "one to three bits flipped in a byte"},
    {"lost-bytes", 4000, "one to four bytes in a row missing"},
    {"repeated-bytes", 4000, "a byte is repeated"},
    {"delayed-bytes", 3000, "a gap of 1..60 ms between two bytes"},
    {"noise", 3000, "1..300 bytes that nobody sent"},
    {"lost-frames", 6000, "a frame missing"},
    {"truncated-frames", 3000, "a frame ends before its delimiter"},
    {"repeated-frames", 4000, "a frame is repeated, at once or up to 60 ms later"},
    {"delayed-frames", 3000, "a frame is 1..60 ms late"},
    {"deaf-mcus", 4000, "one MCU receives nothing for 20 us .. 50 ms"},
    {"silences", 120, "nothing gets through for 1 ms .. 10 s"},
    {"unplugs", 30, "the adapter is unplugged for 10 ms .. 5 s, then another one is plugged in"},
    {"pauses", 60, "the daemon is paused for 0.1 .. 3 s"},
    {"kills", 30, "the daemon is killed, another starts 10 ms .. 3 s later"},
    {"resets", 30, "an MCU is reset and boots 1 ms .. 2 s later"},
    {"lost-requests", 300, "1..16 messages of clients do not reach the daemon"},
    {"lost-answers", 300, "1..16 answers do not reach the clients"},
    {"number-leaps", 120, "a client leaves numbers out: a window of them, or far more"},
    {"reused-numbers", 120, "a request has a number that its client used, or left out, before"},
    {"limit-switches", 0, "a motor's limit switch is active for 5 ms .. 2 s", 600},
    {"emergency-inputs", 0, "an MCU's emergency input is active for 5 ms .. 2 s", 60},
    {"triggers", 0, "an edge at the trigger input of one MCU or of all", 900},
    {"slow-requests", 0, "a request is 1 ms .. 10 s late, after later ones of its client", 300},
    {"late-repeats", 0, "a request is repeated up to half an hour later", 300},
    {"stale-repeats", 0, "a request that an earlier daemon has received is repeated", 100},
    {"floods", 0, "50 .. 2000 requests at once, of up to 200 clients", 4},
    {"crowds", 0, "50 .. 2000 requests at once, of up to 2000 clients", 2},
    {"second-daemons", 12, "another daemon for the same MCUs starts, for 0.1 .. 30 s"},
    {"power-cuts", 0, "the PC loses power for 10 ms .. 3 s, mostly with some MCUs or all", 20},
    {"disk-faults", 0, "the disk fails, or takes up to 2 s for a thing, for 10 ms .. 5 s", 20},
    {"ends", 0, "the daemon is asked to end, as by SIGTERM; another starts when it has", 20},
});
inline constexpr std::size_t kFaultKinds = kFaults.size();
static_assert(kFaultKinds == static_cast<std::size_t>(FaultKind::kEnd) + 1);

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
inline constexpr auto kCommands = std::to_array<KindInfo>({
    {"single-moves", 7200, "one motor, by or to, 1 .. 6000 steps"},
    {"group-moves", 4800, "2 .. 32 motors at once"},
    {"retargets", 2400, "new targets for motors that move"},
    {"stops", 4300, "of some motors that move, or of all"},
    {"emergency-stops", 60, "of all motors"},
    {"set-positions", 700, "of motors at rest"},
    {"switches", 500, "drivers enabled or disabled"},
    {"clears", 500, "of faults"},
    {"repeats", 1900, "a command that was sent before is repeated"},
    {"nonsense", 1700, "commands that no client should send"},
    {"homings", 0, "of 1 .. 4 motors; half of all have a switch then, which bounces", 200},
    {"armings", 0, "1 .. 8 motors wait for the trigger", 200},
    {"disarmings", 0, "of one motor or of all", 60},
    {"confirmations", 0, "that motors stand where they are shown, right or wrong", 60},
    {"user-moves", 0,
     "moves and new targets in user units; most motors have a unit then, half limits", 900},
    {"user-sets", 0, "positions set in user units: of the offset, or of the dial", 200},
    {"speeds", 0, "moves and new targets with a speed, in steps or user units", 600},
    {"leg-moves", 0,
     "moves and new targets of motors with backlash; every second motor has it then", 600},
    {"jogs", 0, "of one motor, renewed and changed until they are ended or their client dies", 600},
    {"motor-pauses", 0, "motors are paused, resumed, held and released", 600},
    {"settings", 0, "other offsets, directions and soft limits of motors at rest", 200},
    {"lines", 0, "motors at rest move along a straight line", 900},
    {"camac-blocks", 0, "programs load, start, stop and read a BUSHD-2, and initialise its crate",
     300},
    {"paths", 0, "motors at rest move along a path, past its points or to rest at each", 500},
    {"trajectories", 0, "motors at rest follow positions in time, told before or while they move",
     500},
    {"shutter-blocks", 0, "programs step and open the shutter of a BUSHD-1; wants --triggers", 200},
    {"line-armings", 0, "2 .. 5 motors wait for the trigger, on one line; wants --triggers", 300},
    {"chased", 0,
     "a motion with a stop, an emergency stop, a pause or a hold right behind it, or soon", 600},
    {"mcu-programs", 0, "programs are put into MCUs, run there and erased; no CAMAC modules then",
     600},
});
inline constexpr std::size_t kCommandKinds = kCommands.size();
static_assert(kCommandKinds == static_cast<std::size_t>(CommandKind::kMcuProgram) + 1);

inline const KindInfo& info(FaultKind kind) {
  return kFaults[static_cast<std::size_t>(kind)];
}
inline const KindInfo& info(CommandKind kind) {
  return kCommands[static_cast<std::size_t>(kind)];
}

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
