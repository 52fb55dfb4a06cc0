// What the longest table costs on the host: 65535 codes, mirrored, so 131070 steps of ramps. Made
// by each law, checked and indexed, as a file, and used: the time of a move and all its ticks.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "engine/run.h"
#include "tables/laws/make.h"
#include "tables/move_time.h"
#include "tables/table_file.h"
#include "tables/table_text.h"

namespace bushd::bench {
namespace {

using tables::TableContent;
using tables::laws::Law;
using tables::laws::Spec;

constexpr double kStartHz = 200;
constexpr double kMaxHz = 20'000;
constexpr std::uint32_t kCodes = tables::kMaxCodes;
constexpr std::uint32_t kTickNs = 2'560'000;
// All ramp, and then a little cruise.
constexpr std::uint32_t kSteps = 2 * kCodes + 1000;

// A few codes less than allowed, where a law cannot be told how many to make.
constexpr double kAlmostAll = kCodes - 10;

Spec spec_of(Law law) {
  Spec spec{.name = "longest", .start_hz = kStartHz, .max_hz = kMaxHz};
  spec.accel.law = law;
  const double acceleration = (kMaxHz * kMaxHz - kStartHz * kStartHz) / (2 * kAlmostAll);
  switch (law) {
    case Law::kPto:
      spec.accel.time_s = 2 * kAlmostAll / (kMaxHz + kStartHz);
      spec.decel = spec.accel;
      break;
    case Law::kTorque: {
      // Constant torque without friction: constant acceleration, found by the law's own way.
      constexpr double kPi = 3.14159265358979323846;
      tables::laws::Motor motor;
      motor.inertia_kgm2 = 1e-5;
      motor.safety = 1;
      const double torque_nm = acceleration * 2 * kPi / motor.steps_per_turn * motor.inertia_kgm2;
      motor.torque = {{0, torque_nm}, {kMaxHz, torque_nm}};
      spec.motor = motor;
      break;
    }
    case Law::kPiecewise:
      spec.accel.legs = {{100, kStartHz}, {30'000, 8'000}, {kAlmostAll - 30'100, kMaxHz}};
      spec.decel = spec.accel;
      spec.decel->legs = {{kAlmostAll - 30'100, 8'000}, {30'000, kStartHz}, {100, kStartHz}};
      break;
    case Law::kV64:
      spec.accel.acceleration = acceleration;
      break;
    default:
      spec.accel.codes = kCodes;
  }
  return spec;
}

template <class T>
T value_or_exit(Result<T> result) {
  if (result) return std::move(*result);
  std::fprintf(stderr, "%s\n", result.error().text().c_str());
  std::exit(1);
}

TableContent longest() {
  return value_or_exit(make_content(spec_of(Law::kConstant)));
}

void make_by_law(benchmark::State& state, Law law) {
  const Spec spec = spec_of(law);
  std::size_t codes = 0;
  for (auto _ : state) {
    const TableContent content = value_or_exit(make_content(spec));
    codes = content.accel.size();
    benchmark::DoNotOptimize(content.accel.data());
  }
  state.counters["codes"] = static_cast<double>(codes);
}

void check_and_index(benchmark::State& state) {
  const TableContent content = longest();
  for (auto _ : state) benchmark::DoNotOptimize(tables::make(content));
}

void write_text(benchmark::State& state) {
  const TableContent content = longest();
  for (auto _ : state) benchmark::DoNotOptimize(tables::to_text(content));
}

void read_text(benchmark::State& state) {
  const std::string text = tables::to_text(longest());
  for (auto _ : state) benchmark::DoNotOptimize(tables::parse(text, ""));
}

void time_of_move(benchmark::State& state) {
  const auto table = value_or_exit(tables::make(longest()));
  for (auto _ : state) benchmark::DoNotOptimize(tables::move_time(table->view(), kSteps));
}

template <class Displacement>
void expand(benchmark::State& state,
            std::size_t (*expand_block)(bushd_run*, std::uint32_t, std::size_t, Displacement*,
                                        std::size_t)) {
  const auto table = value_or_exit(tables::make(longest()));
  std::vector<Displacement> block(4096);
  std::size_t ticks = 0;
  for (auto _ : state) {
    bushd_run run;
    bushd_run_start(&run, &table->view(), kSteps, 1);
    ticks = 0;
    while (!bushd_run_done(&run)) {
      ticks += expand_block(&run, kTickNs, block.size(), block.data(), 1);
      benchmark::ClobberMemory();
    }
  }
  state.counters["ticks"] = static_cast<double>(ticks);
}

void expand_coarse(benchmark::State& state) {
  expand<std::uint8_t>(state, bushd_run_expand_coarse);
}
void expand_fine(benchmark::State& state) {
  expand<std::int16_t>(state, bushd_run_expand_fine);
}

constexpr auto kUnit = benchmark::kMillisecond;
BENCHMARK_CAPTURE(make_by_law, constant, Law::kConstant)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, scurve, Law::kScurve)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, exponential, Law::kExponential)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, pto, Law::kPto)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, torque, Law::kTorque)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, piecewise, Law::kPiecewise)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, recurrence, Law::kRecurrence)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_law, v64, Law::kV64)->Unit(kUnit);
BENCHMARK(check_and_index)->Unit(kUnit);
BENCHMARK(write_text)->Unit(kUnit);
BENCHMARK(read_text)->Unit(kUnit);
BENCHMARK(time_of_move)->Unit(kUnit);
BENCHMARK(expand_coarse)->Unit(kUnit);
BENCHMARK(expand_fine)->Unit(kUnit);

}  // namespace
}  // namespace bushd::bench

BENCHMARK_MAIN();
