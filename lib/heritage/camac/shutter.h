// What BUSHD-1 wants of its motor, in full before it begins: delays, reversal and the sensor's time
// are exact, so they are not the module's. Whoever implements this makes the steps and tells the
// module about them; called from within the module's functions, it must not call back into it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <vector>

namespace bushd::camac {

struct SingleStep {
  // For the sensor to tell the step.
  static constexpr std::int64_t kSensorUs = 1'500'000;

  bool left = false;
  bool with_sensor = false;
};

// Automatic travel from one limit switch to the other and back. Before step k (from 0) of either
// run stands codes[k].
struct Travel {
  static constexpr std::int64_t kUnitUs = 50;             // of the codes and of the return's delay
  static constexpr std::int64_t kFixedDelayUs = 150'000;  // from a reactor start to the first run

  bool left = false;                   // the first run
  std::vector<std::uint16_t> codes{};  // one for each step; 1..30000
  std::uint16_t return_delay = 1;      // 1..30000
  // Each reactor start begins a travel; one that comes during a travel is ignored. Otherwise one
  // travel begins at once.
  bool synchronous = false;

  std::int64_t return_delay_us() const { return return_delay * kUnitUs; }
  // When a travel begins that a reactor start at this time has released.
  static std::int64_t first_run_us(std::int64_t reactor_start_us) {
    return reactor_start_us + kFixedDelayUs;
  }
  // From the beginning of a run to its step `step`, from 0.
  std::int64_t step_us(std::size_t step) const {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i <= step; ++i) sum += codes[i];
    return sum * kUnitUs;
  }
  // When the return begins. The delay counts from the reactor start, but the shutter must have
  // reached the limit; without reactor starts it counts from there.
  std::int64_t return_us(std::int64_t reactor_start_us, std::int64_t arrival_us) const {
    if (!synchronous) return arrival_us + return_delay_us();
    return std::max(arrival_us, reactor_start_us + return_delay_us());
  }
};

class Shutter {
 public:
  virtual ~Shutter() = default;

  // The memory or the limits do not allow a travel: what people are told.
  virtual void refuses(std::string_view /*why*/) {}
  // False: it cannot be made, and nothing moves.
  virtual bool step(const SingleStep& step) = 0;
  virtual bool travel(const Travel& travel) = 0;
  // Before its next step. To be answered by Bushd1::stands.
  virtual void stop() = 0;
};

}  // namespace bushd::camac
