// What the longest table costs on the host: 65535 codes, mirrored, so 131070 steps of ramps. Made
// by each profile, checked and indexed, as a file, and used: the time of a move and all its ticks.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "engine/run.h"
#include "tables/move_time.h"
#include "tables/profiles/make.h"
#include "tables/table_file.h"
#include "tables/table_text.h"

namespace bushd::bench {
namespace {

using tables::TableContent;
using tables::profiles::Profile;
using tables::profiles::Spec;

constexpr double kStartHz = 200;
constexpr double kMaxHz = 20'000;
constexpr std::uint32_t kCodes = tables::kMaxCodes;
constexpr std::uint32_t kTickNs = 2'560'000;
// All ramp, and then a little cruise.
constexpr std::uint32_t kSteps = 2 * kCodes + 1000;

// A few codes less than allowed, where a profile cannot be told how many to make.
constexpr double kAlmostAll = kCodes - 10;

Spec spec_of(Profile profile) {
  Spec spec{.name = "longest", .start_hz = kStartHz, .max_hz = kMaxHz};
  spec.accel.profile = profile;
  const double acceleration = (kMaxHz * kMaxHz - kStartHz * kStartHz) / (2 * kAlmostAll);
  switch (profile) {
    case Profile::kPto:
      spec.accel.time_s = 2 * kAlmostAll / (kMaxHz + kStartHz);
      spec.decel = spec.accel;
      break;
    case Profile::kTorque: {
      // Constant torque without friction: constant acceleration, found by the profile's own way.
      constexpr double kPi = 3.14159265358979323846;
      tables::profiles::Motor motor;
      motor.inertia_kgm2 = 1e-5;
      motor.safety = 1;
      const double torque_nm = acceleration * 2 * kPi / motor.steps_per_turn * motor.inertia_kgm2;
      motor.torque = {{0, torque_nm}, {kMaxHz, torque_nm}};
      spec.motor = motor;
      break;
    }
    case Profile::kPiecewise:
      spec.accel.legs = {{100, kStartHz}, {30'000, 8'000}, {kAlmostAll - 30'100, kMaxHz}};
      spec.decel = spec.accel;
      spec.decel->legs = {{kAlmostAll - 30'100, 8'000}, {30'000, kStartHz}, {100, kStartHz}};
      break;
    case Profile::kV64:
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
  return value_or_exit(make_content(spec_of(Profile::kConstant)));
}

void make_by_profile(benchmark::State& state, Profile profile) {
  const Spec spec = spec_of(profile);
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
    bushd_run_start(&run, &table->view(), kSteps, 1, 0);
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
BENCHMARK_CAPTURE(make_by_profile, constant, Profile::kConstant)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, scurve, Profile::kScurve)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, exponential, Profile::kExponential)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, pto, Profile::kPto)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, torque, Profile::kTorque)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, piecewise, Profile::kPiecewise)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, recurrence, Profile::kRecurrence)->Unit(kUnit);
BENCHMARK_CAPTURE(make_by_profile, v64, Profile::kV64)->Unit(kUnit);
BENCHMARK(check_and_index)->Unit(kUnit);
BENCHMARK(write_text)->Unit(kUnit);
BENCHMARK(read_text)->Unit(kUnit);
BENCHMARK(time_of_move)->Unit(kUnit);
BENCHMARK(expand_coarse)->Unit(kUnit);
BENCHMARK(expand_fine)->Unit(kUnit);

}  // namespace
}  // namespace bushd::bench

BENCHMARK_MAIN();
