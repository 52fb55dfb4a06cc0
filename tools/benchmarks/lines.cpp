// What a motor on a line costs the host beside one that moves alone: both are expanded by the same
// axes, in turns, in the blocks of ticks that a frame to one MCU holds. Prints motor-ticks per
// second of one core, and how many times as long a line's take.
//
//     bushd_bench_lines
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <memory>
#include <vector>

#include "motion/axis.h"
#include "motion/way.h"
#include "tools/benchmarks/workload.h"

namespace {

using bushd::motion::Axis;
using bushd::motion::Tick;
using bushd::motion::Way;

constexpr std::size_t kMotors = 32;
constexpr std::uint32_t kTickNs = bushd::bench::Moves::kTickNs;
constexpr std::int64_t kSteps = bushd::bench::Moves::kSteps;
constexpr unsigned kBlock = 16;
constexpr int kRuns = 15;

struct Took {
  double ns = 0;
  std::int64_t motor_ticks = 0;
};

// Each motor of a line makes another share of it.
std::int64_t steps_of(std::size_t motor) {
  return kSteps - static_cast<std::int64_t>(motor) * kSteps / static_cast<std::int64_t>(kMotors);
}

class Bench {
 public:
  explicit Bench(bushd_format format) : format_(format) {
    std::vector<Way::Motor> motors;
    for (std::size_t m = 0; m < kMotors; ++m) {
      tables_.push_back(std::make_unique<bushd::bench::Table>(
          20'000.0, 10'000.0 - 25.0 * static_cast<double>(m), 200));
      motors.push_back(
          {.table = tables_.back()->view(), .from = 0, .to = steps_of(m), .shortest_delay = 0});
    }
    way_ = Way(std::move(motors));
  }

  Took line() const { return expand(true); }
  Took single() const { return expand(false); }

 private:
  Took expand(bool line) const {
    std::vector<Axis> axes;
    Tick ticks = 0;
    for (std::size_t m = 0; m < kMotors; ++m) {
      Axis& axis = axes.emplace_back(*tables_[m]->view(), kTickNs, format_);
      if (line) {
        axis.start_line(0, way_.share(m, 0, way_.longest()), 0, way_.shortest_delay());
      } else {
        axis.start(0, kSteps, 0);
      }
      ticks += axis.end_tick();
    }
    std::vector<std::int16_t> out(kBlock * kMotors);
    const std::clock_t begun = std::clock();
    for (Tick first = 0; std::ranges::any_of(axes, [&](Axis& a) { return a.end_tick() > first; });
         first += kBlock) {
      for (std::size_t m = 0; m < kMotors; ++m) {
        if (axes[m].end_tick() <= first) continue;
        axes[m].render(first, kBlock, &out[m], kMotors);
        axes[m].executed(first);
      }
    }
    const double s = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
    return {.ns = s * 1e9, .motor_ticks = ticks};
  }

  bushd_format format_;
  std::vector<std::unique_ptr<bushd::bench::Table>> tables_;
  Way way_;
};

double best(std::vector<double>& all) {
  return *std::ranges::min_element(all);
}

}  // namespace

int main() {
  for (const auto& [name, format] :
       {std::pair{"coarse", BUSHD_FORMAT_COARSE}, {"fine", BUSHD_FORMAT_FINE}}) {
    const Bench bench(format);
    std::vector<double> line;
    std::vector<double> single;
    for (int i = 0; i < kRuns; ++i) {
      const Took one = bench.single();
      single.push_back(one.ns / static_cast<double>(one.motor_ticks));
      const Took other = bench.line();
      line.push_back(other.ns / static_cast<double>(other.motor_ticks));
    }
    fmt::print(
        "{:6} {:2} single moves {:6.1f} M motor-ticks/s, a line of {:2} motors {:6.1f} M, {:.2f} "
        "times as long\n",
        name, kMotors, 1e3 / best(single), kMotors, 1e3 / best(line), best(line) / best(single));
  }
}
