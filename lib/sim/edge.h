// What can be seen on the pins of the virtual MCUs.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bushd::sim {

// Simulated time since the beginning of the simulation, ns. It has nothing to do with the clock on
// the wall.
using TimeNs = std::int64_t;
inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

enum class Signal : std::uint8_t {
  kStep,
  kDir,
  kEnable,
  kCommonDir,
  kPositionCompare,
  // Inputs: high where a contact is closed.
  kTrigger,
  kEmergency
};

inline constexpr std::size_t kOutputsPerMcu = 16;

struct Edge {
  TimeNs time_ns;
  std::size_t mcu;  // position on the bus, in the order of Bus::add_mcu
  Signal signal;
  std::uint8_t index;  // output 0..15 of kStep and kDir, else 0
  bool level;
};

// What can be measured at an MCU: the current of a winding, in A, or of the supply, as its sensor
// reads it: 0..1023.
struct Sample {
  static constexpr std::uint8_t kSupply = 4;
  TimeNs time_ns;
  std::size_t mcu;
  std::uint8_t winding;  // 0..3, or kSupply
  double value;
};

// All pins are low when the simulation begins.
class EdgeSink {
 public:
  EdgeSink() = default;
  EdgeSink(const EdgeSink&) = delete;
  EdgeSink& operator=(const EdgeSink&) = delete;
  virtual ~EdgeSink() = default;

  // In order of time for each MCU, but not from one MCU to another.
  virtual void edge(const Edge& edge) = 0;

  // In order of time for each MCU, as edges are; 0 when the simulation begins.
  virtual void sample(const Sample& /*sample*/) {}

  // Every edge of every MCU before `until_ns` has been given; later ones lie at or after it.
  virtual void settled(TimeNs until_ns) = 0;
};

}  // namespace bushd::sim
