// For valgrind --tool=callgrind (tools/bench --callgrind), which counts the instructions of what is
// named on the command line: expands the moves of the benchmark once, and prints how many
// motor-ticks that were.
//   coarse, fine   their expansion: bushd_run_expand_coarse, bushd_run_expand_fine
//   framed         coarse expansion and TICKS frames of 16 motors: expand_coarse,
//   bushd_frame_encode
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string_view>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "tools/benchmarks/workload.h"

namespace bushd::bench {
namespace {

constexpr size_t kMotors = 32;
constexpr size_t kBlockTicks = 64;

size_t coarse() {
  Moves moves(kMotors);
  moves.start();
  std::vector<uint8_t> out(kBlockTicks * kMotors);
  size_t motor_ticks = 0;
  while (const size_t active = moves.expand_coarse(kBlockTicks, out.data())) motor_ticks += active;
  return motor_ticks;
}

size_t fine() {
  Moves moves(kMotors);
  moves.start();
  std::vector<int16_t> out(kBlockTicks * kMotors);
  size_t motor_ticks = 0;
  while (const size_t active = moves.expand_fine(kBlockTicks, out.data())) motor_ticks += active;
  return motor_ticks;
}

// As the daemon does: a frame's ticks are expanded into it.
size_t framed() {
  constexpr uint8_t kFrameMotors = BUSHD_MOTORS_PER_MCU;
  const uint8_t ticks = bushd_ticks_capacity(kFrameMotors, false);
  Moves moves(kFrameMotors);
  moves.start();
  const uint16_t delays[kFrameMotors] = {};
  uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
  uint8_t wire[BUSHD_FRAME_MAX_WIRE];
  size_t motor_ticks = 0;
  uint32_t tick = 0;
  const size_t head = bushd_encode_ticks_head(0, 0, 0, ticks, 0xFFFF, delays, payload);
  while (const size_t active = moves.expand_coarse(ticks, payload + head)) {
    bushd_encode_ticks_head(0, 0, tick, ticks, 0xFFFF, delays, payload);
    bushd_frame_encode(1, BUSHD_MSG_TICKS, static_cast<uint8_t>(tick / ticks), payload,
                       head + size_t{ticks} * kFrameMotors, wire);
    tick += ticks;
    motor_ticks += active;
  }
  return motor_ticks;
}

}  // namespace
}  // namespace bushd::bench

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what != "coarse" && what != "fine" && what != "framed") {
    std::fprintf(stderr, "usage: bushd_bench_instructions coarse|fine|framed\n");
    return 2;
  }
  std::printf("%zu\n", what == "fine"     ? bushd::bench::fine()
                       : what == "framed" ? bushd::bench::framed()
                                          : bushd::bench::coarse());
  return 0;
}
