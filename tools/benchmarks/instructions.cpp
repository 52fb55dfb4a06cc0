// For valgrind --tool=callgrind --toggle-collect=bushd_run_expand_coarse (tools/bench --callgrind):
// expands the moves of the benchmark once and prints how many motor-ticks that were.
#include <cstdint>
#include <cstdio>
#include <vector>

#include "tools/benchmarks/workload.h"

int main() {
  constexpr size_t kMotors = 32;
  constexpr size_t kBlockTicks = 64;
  bushd::bench::Moves moves(kMotors);
  std::vector<uint8_t> out(kBlockTicks * kMotors);
  size_t motor_ticks = 0;
  moves.start();
  while (const size_t active = moves.expand_coarse(kBlockTicks, out.data())) motor_ticks += active;
  std::printf("%zu\n", motor_ticks);
}
