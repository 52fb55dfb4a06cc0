// How exactly steps fall where the table puts them: expansion and slots against exact step times.
//
// Within a tick the exact position is a curve whose slope (the speed, 1/delay) changes by dv; the
// MCU follows its chord. A curve of slopes within dv lies at most dv T/4 off its chord (dv T/8 = a
// T^2/8 where the slope changes evenly); the ends of the chord are rounded down to 1/256 step; a
// step is made at the beginning of its slot. So with v the chord's slope and S slots
//
//     fine    |error| <= (dv T/4 + 1/256) / v + T/S
//     coarse  |error| <= the longest delay that runs in the tick + T/S
//
// and never more than T, since every step is counted in its own tick. The last tick of a move has
// that bound only: its chord ends at the tick's end, the curve at the last step. Exit code 1 if a
// step breaks its bound.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "engine/run.h"
#include "engine/slots.h"
#include "tools/benchmarks/workload.h"

namespace bushd::bench {
namespace {

constexpr uint16_t kSlots = 256;

struct Statistics {
  size_t steps = 0;
  double sum_of_squares = 0;
  double worst_ns = 0;
  double bound_ns = 0;        // the greatest bound that a step had
  double share_of_bound = 0;  // the worst step's error over its own bound

  void add(double error_ns, double bound) {
    ++steps;
    sum_of_squares += error_ns * error_ns;
    worst_ns = std::max(worst_ns, std::abs(error_ns));
    bound_ns = std::max(bound_ns, bound);
    share_of_bound = std::max(share_of_bound, std::abs(error_ns) / bound);
  }
  double rms_ns() const {
    return steps == 0 ? 0 : std::sqrt(sum_of_squares / static_cast<double>(steps));
  }
};

enum Phase { kFirstTick, kRamp, kCruise, kLastTick, kPhases };
const char* const kPhaseNames[kPhases] = {"first tick", "ramps", "cruise", "last tick"};

struct Move {
  const bushd_table* table;
  uint32_t steps;
  uint32_t tick_ns;
  bool fine;
};

// What runs during one tick: the delays, and how far the exact position goes.
struct Tick {
  double longest_ns = 0;
  double shortest_ns = 0;
  Phase phase = kRamp;
};

class Measurement {
 public:
  explicit Measurement(const Move& move) : move_(move), masks_(kSlots) {
    uint64_t time_ns = 0;
    for (uint32_t j = 1; j <= move.steps; ++j) {
      delays_ns_.push_back(uint64_t{bushd_table_delay(move.table, j, move.steps)} *
                           move.table->time_unit_ns);
      time_ns += delays_ns_.back();
      times_ns_.push_back(time_ns);
    }
    bushd_run_start(&run_, move.table, move.steps, 1, 0);
  }

  void measure(Statistics* statistics) {
    for (uint64_t n = 0; made_ < move_.steps; ++n) measure_tick(n, statistics);
  }

 private:
  int16_t next_displacement() {
    int16_t displacement = 0;
    if (move_.fine) {
      bushd_run_expand_fine(&run_, move_.tick_ns, 1, &displacement, 1);
    } else {
      uint8_t counts = 0;
      bushd_run_expand_coarse(&run_, move_.tick_ns, 1, &counts, 1);
      displacement = bushd_coarse_to_fine(counts);
    }
    return displacement;
  }

  Tick look_at(uint64_t n) const {
    const uint64_t end_ns = (n + 1) * move_.tick_ns;
    Tick tick;
    size_t j = made_;
    tick.longest_ns = tick.shortest_ns = static_cast<double>(delays_ns_[j]);
    while (times_ns_[j] <= end_ns && j + 1 < times_ns_.size()) {
      ++j;
      tick.longest_ns = std::max(tick.longest_ns, static_cast<double>(delays_ns_[j]));
      tick.shortest_ns = std::min(tick.shortest_ns, static_cast<double>(delays_ns_[j]));
    }
    const double cruise_ns = static_cast<double>(move_.table->cruise) * move_.table->time_unit_ns;
    if (times_ns_.back() <= end_ns) {
      tick.phase = kLastTick;
    } else if (n == 0) {
      tick.phase = kFirstTick;
    } else if (tick.longest_ns == cruise_ns) {
      tick.phase = kCruise;
    }
    return tick;
  }

  double bound_ns(const Tick& tick, int16_t displacement) const {
    const double tick_ns = move_.tick_ns;
    if (tick.phase == kLastTick) return tick_ns;
    double bound = tick.longest_ns;
    if (move_.fine) {
      const double slopes = 1 / tick.shortest_ns - 1 / tick.longest_ns;
      const double chord = displacement / 256.0 / tick_ns;
      bound = (slopes * tick_ns / 4 + 1.0 / 256) / chord;
    }
    return std::min(bound + tick_ns / kSlots, tick_ns);
  }

  void measure_tick(uint64_t n, Statistics* statistics) {
    const Tick tick = look_at(n);
    std::fill(masks_.begin(), masks_.end(), uint16_t{0});
    const int16_t displacement = next_displacement();
    bushd_slots_add(masks_.data(), kSlots, 1, displacement, &remainder_,
                    move_.fine ? BUSHD_CROSSING_FINE : BUSHD_CROSSING_COARSE);
    for (size_t s = 0; s < kSlots; ++s) {
      if (masks_[s] == 0) continue;
      const double at_ns = static_cast<double>(n * move_.tick_ns) +
                           static_cast<double>(move_.tick_ns) * static_cast<double>(s) / kSlots;
      statistics[tick.phase].add(at_ns - static_cast<double>(times_ns_.at(made_++)),
                                 bound_ns(tick, displacement));
    }
  }

  Move move_;
  std::vector<uint64_t> delays_ns_;
  std::vector<uint64_t> times_ns_;
  std::vector<uint16_t> masks_;
  bushd_run run_{};
  int16_t remainder_ = 0;
  size_t made_ = 0;
};

bool report(bool fine) {
  constexpr uint32_t kTickNs = 1'000'000;
  Statistics statistics[kPhases];
  for (const double start : {0.0, 2500.0}) {
    for (int m = 0; m < 32; ++m) {
      const Table table(20'000.0, 10'000.0 - 225.0 * m, 200, start);
      for (const uint32_t steps :
           {20'000u + static_cast<uint32_t>(m), 500u + static_cast<uint32_t>(m)}) {
        Measurement({table.view(), steps, kTickNs, fine}).measure(statistics);
      }
    }
  }
  bool good = true;
  for (int phase = 0; phase < kPhases; ++phase) {
    const Statistics& s = statistics[phase];
    std::printf("%-7s %-10s %8zu %9.2f %9.2f %9.2f %12.0f %%\n", fine ? "fine" : "coarse",
                kPhaseNames[phase], s.steps, s.rms_ns() / 1e3, s.worst_ns / 1e3, s.bound_ns / 1e3,
                100 * s.share_of_bound);
    good = good && s.share_of_bound <= 1;
  }
  // What the project promises for cruise.
  if (fine)
    good = good && statistics[kCruise].rms_ns() <= 5e3 && statistics[kCruise].worst_ns <= 25e3;
  return good;
}

}  // namespace
}  // namespace bushd::bench

int main() {
  std::printf(
      "Step times against the table, us: 1 ms ticks, 256 slots, 20000 steps/s^2 from 0 and 2500 to "
      "3025 .. 10000 steps/s\n");
  std::printf("%-7s %-10s %8s %9s %9s %9s %14s\n", "format", "where", "steps", "rms", "max",
              "bound", "error/bound");
  const bool fine = bushd::bench::report(true);
  const bool coarse = bushd::bench::report(false);
  if (!fine || !coarse) std::printf("a step broke its bound\n");
  return fine && coarse ? EXIT_SUCCESS : EXIT_FAILURE;
}
