// What planning a path costs: 100000 points of 6 motors, a contour whose corners are passed, as
// processor time of all slices together and of the longest one.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

#include "motion/path.h"

namespace bushd::bench {
namespace {

constexpr int kPoints = 100'000;
constexpr std::size_t kMotors = 6;
constexpr std::size_t kSegmentsPerSlice = 100;  // as the daemon (daemon/services/lines_path.cpp)

double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

// 400 to 10000 steps/s at constant acceleration.
std::vector<std::uint16_t> ramp() {
  std::vector<std::uint16_t> codes;
  while (codes.size() < 2000) {
    const double slower = 2500 / std::sqrt(1.0 + static_cast<double>(codes.size()));
    codes.push_back(static_cast<std::uint16_t>(std::max(100.0, slower)));
  }
  return codes;
}

// Motors swing by so many steps at different rates.
std::vector<std::int64_t> contour(double amplitude) {
  std::vector<std::int64_t> points;
  for (int i = 0; i <= kPoints; ++i) {
    for (std::size_t m = 0; m < kMotors; ++m) {
      const double phase = i / (1500.0 + 100.0 * static_cast<double>(m));
      points.push_back(std::llround(amplitude * std::sin(phase + static_cast<double>(m))));
    }
  }
  return points;
}

void measure(const char* name, const bushd_table& table, double amplitude) {
  const std::vector<std::int64_t> points = contour(amplitude);
  double best_ms = 1e9;
  double slice_ms = 0;
  std::uint64_t steps = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const double begin_ms = cpu_ms();
    const std::span all(points);
    motion::Path path(std::vector<motion::Path::Motor>(kMotors, {&table}), all.first(kMotors),
                      motion::Path::Corners::kContinuous, kPoints);
    for (std::size_t at = kMotors; at < all.size(); at += kMotors) {
      path.add(all.subspan(at, kMotors));
    }
    double longest_ms = 0;
    for (bool done = false; !done;) {
      const double slice_begin_ms = cpu_ms();
      done = path.plan(kSegmentsPerSlice);
      longest_ms = std::max(longest_ms, cpu_ms() - slice_begin_ms);
    }
    const double all_ms = cpu_ms() - begin_ms;
    if (all_ms < best_ms) slice_ms = longest_ms;
    best_ms = std::min(best_ms, all_ms);
    steps = path.steps();
  }
  std::printf("%-32s %8.1f ms, longest slice %.3f ms, %llu steps\n", name, best_ms, slice_ms,
              static_cast<unsigned long long>(steps));
}

}  // namespace
}  // namespace bushd::bench

int main() {
  const std::vector<std::uint16_t> codes = bushd::bench::ramp();
  bushd_table table{};
  table.accel.code = table.decel.code = codes.data();
  table.accel.count = table.decel.count = static_cast<std::uint16_t>(codes.size());
  table.cruise = 100;
  table.time_unit_ns = 1000;
  bushd::bench::measure("100000 points, 10 steps each", table, 10'000);
  bushd::bench::measure("100000 points, 100 steps each", table, 100'000);
  return 0;
}
