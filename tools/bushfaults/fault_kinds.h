// The kinds of trouble, each with its flag and its usual rate.
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
};
inline constexpr std::size_t kFaultKinds = 15;
inline constexpr std::size_t kGarblings = 9;

struct FaultKindInfo {
  std::string_view name;  // as a flag and in the summary
  double per_hour;        // by default
  std::string_view what;
};

const FaultKindInfo& info(FaultKind kind);

using Rates = std::array<double, kFaultKinds>;  // per simulated hour
using Counts = std::array<std::uint64_t, kFaultKinds>;
Rates usual_rates();

}  // namespace bushfaults
