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

// Which run the adjustable delay after a reactor start releases: the report can be read in both
// ways. The fixed one releases the other.
enum class AdjustableDelay { kReturn, kOpening };

// Automatic travel from one limit switch to the other and back. Before step k (from 0) of either
// run stands codes[k].
struct Travel {
  static constexpr std::int64_t kUnitUs = 50;             // of the codes and of the delay
  static constexpr std::int64_t kFixedDelayUs = 150'000;  // from a reactor start

  bool left = false;                   // the first run
  std::vector<std::uint16_t> codes{};  // one for each step; 1..30000
  std::uint16_t delay = 1;             // the adjustable one, 1..30000
  // Each reactor start begins a travel; one that comes during a travel is ignored. Otherwise one
  // travel begins at once.
  bool synchronous = false;
  AdjustableDelay adjusts = AdjustableDelay::kReturn;  // where it is synchronous

  std::int64_t delay_us() const { return delay * kUnitUs; }
  bool adjusts_opening() const { return synchronous && adjusts == AdjustableDelay::kOpening; }
  // From a reactor start to the first run.
  std::int64_t first_run_delay_us() const { return adjusts_opening() ? delay_us() : kFixedDelayUs; }
  // From a reactor start, or without them from arrival, to the return.
  std::int64_t return_delay_us() const { return adjusts_opening() ? kFixedDelayUs : delay_us(); }
  // When a travel begins that a reactor start at this time has released.
  std::int64_t first_run_us(std::int64_t reactor_start_us) const {
    return reactor_start_us + first_run_delay_us();
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
