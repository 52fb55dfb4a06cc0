// How fast the host makes packets. Rates are motor-ticks per second of one core (items_per_second).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "tools/benchmarks/workload.h"

namespace bushd::bench {
namespace {

constexpr size_t kMotors = 32;
constexpr uint16_t kHalfSpeed = 1000;  // shortest delay of 5000 steps/s

void expand_coarse(benchmark::State& state, uint16_t shortest_delay = 0) {
  const auto block = static_cast<size_t>(state.range(0));
  Moves moves(kMotors);
  std::vector<uint8_t> out(block * kMotors);
  size_t motor_ticks = 0;
  for (auto _ : state) {
    moves.start(shortest_delay);
    while (const size_t active = moves.expand_coarse(block, out.data())) {
      benchmark::DoNotOptimize(out.data());
      benchmark::ClobberMemory();
      motor_ticks += active;
    }
  }
  state.SetItemsProcessed(static_cast<int64_t>(motor_ticks));
}
BENCHMARK_CAPTURE(expand_coarse, table, 0)
    ->ArgName("block_ticks")
    ->Arg(1)
    ->Arg(15)
    ->Arg(64)
    ->Arg(256);
BENCHMARK_CAPTURE(expand_coarse, shortest_delay, kHalfSpeed)
    ->ArgName("block_ticks")
    ->Arg(15)
    ->Arg(64);

void expand_fine(benchmark::State& state, uint16_t shortest_delay = 0) {
  const auto block = static_cast<size_t>(state.range(0));
  Moves moves(kMotors);
  std::vector<int16_t> out(block * kMotors);
  size_t motor_ticks = 0;
  for (auto _ : state) {
    moves.start(shortest_delay);
    while (const size_t active = moves.expand_fine(block, out.data())) {
      benchmark::DoNotOptimize(out.data());
      benchmark::ClobberMemory();
      motor_ticks += active;
    }
  }
  state.SetItemsProcessed(static_cast<int64_t>(motor_ticks));
}
BENCHMARK_CAPTURE(expand_fine, table, 0)->ArgName("block_ticks")->Arg(1)->Arg(7)->Arg(64)->Arg(256);
BENCHMARK_CAPTURE(expand_fine, shortest_delay, kHalfSpeed)->ArgName("block_ticks")->Arg(7)->Arg(64);

constexpr uint8_t kFrameMotors = BUSHD_MOTORS_PER_MCU;

// Full TICKS frames of 16 moving motors, from displacements in memory to bytes for the line.
void frame_coarse(benchmark::State& state) {
  const uint8_t ticks = bushd_ticks_capacity(kFrameMotors, false);
  const size_t bytes = size_t{ticks} * kFrameMotors;
  constexpr size_t kFrames = 160;
  Moves moves(kFrameMotors);
  moves.start();
  std::vector<uint8_t> displacements(bytes * kFrames);
  moves.expand_coarse(ticks * kFrames, displacements.data());
  const uint16_t delays[kFrameMotors] = {};
  uint8_t wire[BUSHD_FRAME_MAX_WIRE];
  size_t frames = 0;
  for (auto _ : state) {
    for (size_t f = 0; f < kFrames; ++f) {
      uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
      const size_t head = bushd_encode_ticks_head(0, 0, static_cast<uint32_t>(frames * ticks),
                                                  ticks, 0xFFFF, delays, payload);
      std::copy_n(displacements.data() + f * bytes, bytes, payload + head);
      benchmark::DoNotOptimize(bushd_frame_encode(1, BUSHD_MSG_TICKS, static_cast<uint8_t>(frames),
                                                  payload, head + bytes, wire));
      benchmark::ClobberMemory();
      ++frames;
    }
  }
  state.SetItemsProcessed(static_cast<int64_t>(frames * bytes));
}
BENCHMARK(frame_coarse);

void receive_coarse(benchmark::State& state) {
  uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD] = {};
  for (size_t i = 0; i < sizeof payload; ++i) payload[i] = static_cast<uint8_t>(i % 11);
  uint8_t wire[BUSHD_FRAME_MAX_WIRE];
  const size_t size = bushd_frame_encode(1, BUSHD_MSG_TICKS, 1, payload, sizeof payload, wire);
  bushd_receiver receiver{};
  bushd_frame frame;
  for (auto _ : state) {
    for (size_t i = 0; i < size; ++i) {
      benchmark::DoNotOptimize(bushd_receive_byte(&receiver, wire[i], &frame));
    }
  }
  state.SetBytesProcessed(static_cast<int64_t>(static_cast<size_t>(state.iterations()) * size));
}
BENCHMARK(receive_coarse);

void crc(benchmark::State& state) {
  std::vector<uint8_t> bytes(252, 0x5A);
  for (auto _ : state) {
    benchmark::DoNotOptimize(bushd_crc32(BUSHD_CRC32_START, bytes.data(), bytes.size()));
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(
      static_cast<int64_t>(static_cast<size_t>(state.iterations()) * bytes.size()));
}
BENCHMARK(crc);

}  // namespace
}  // namespace bushd::bench

BENCHMARK_MAIN();
