// A line (LINE_RUN) on the image for ATmega2560: its motors follow one run, asked for their reports
// meanwhile. Every step must be in its slot, and no tick late.
#include "sim/avr/ramps.h"

namespace bushd::sim::line_runs_test {
namespace {

constexpr std::uint32_t kLongest = 3000;

struct LineLoad {
  RampLoad ramp;
  std::uint8_t motors;
  std::uint32_t apart;  // each motor makes so many steps less than the one before
};

class AvrLineRuns : public AvrRamps, public testing::WithParamInterface<LineLoad> {
 protected:
  static std::uint32_t increment(std::uint8_t motor) { return kLongest - GetParam().apart * motor; }
  static bool is_forward(std::uint8_t motor) { return motor % 3 != 1; }

  // Where each step of a motor falls: step j at ceil(128 (2j - 1) L / N) + 128 parts of 1/256 step
  // of the run, whose step k comes after the delays of ramps.h. One at a tick's end
  // falls into its last slot.
  static std::vector<Place> places_of_steps(std::uint32_t increment) {
    const RampLoad& ramp = GetParam().ramp;
    std::vector<std::int64_t> begins{0};
    for (const std::uint16_t units : delays_of_run(ramp.cruise, kLongest)) {
      begins.push_back(begins.back() + std::int64_t{units} * ramp.unit_ns);
    }
    const std::int64_t slot_time = 256 * std::int64_t{ramp.tick_ns};
    std::vector<Place> places;
    for (std::int64_t j = 1; j <= increment; ++j) {
      const std::int64_t numerator = 128 * (2 * j - 1) * kLongest;
      const std::int64_t parts = (numerator + increment - 1) / increment + 128;
      const auto step = static_cast<std::size_t>((parts - 1) / 256);  // that are over
      const std::int64_t part = parts - 256 * static_cast<std::int64_t>(step);
      const std::int64_t time = 256 * begins[step] + part * (begins[step + 1] - begins[step]);
      const std::int64_t rest = time * kSlots % slot_time;
      const std::int64_t slot = time * kSlots / slot_time;
      const bool at_end = rest == 0 && slot % kSlots == 0;
      places.push_back({at_end ? slot - 1 : slot, rest * 100 >= slot_time * 99});
    }
    return places;
  }

  void begin_line(std::uint32_t first) {
    std::vector<bushd_line_entry> entries;
    for (std::uint8_t m = 0; m < GetParam().motors; ++m) {
      entries.push_back({m, static_cast<std::int8_t>(is_forward(m) ? 1 : -1), increment(m)});
    }
    bushd_line_run message{};
    message.first_tick = first;
    message.line = {0, false, 0, kLongest, 0, kLongest, 0, nullptr};
    master_.post(kAddress, BUSHD_MSG_LINE_RUN, payload_of([&](std::uint8_t* to) {
                   return bushd_encode_line_run(&message, entries.data(), GetParam().motors, to);
                 }));
  }
};

TEST_P(AvrLineRuns, KeepTheirSlots) {
  const LineLoad& load = GetParam();
  ASSERT_NO_FATAL_FAILURE(make_ready(load.ramp));
  std::vector<std::vector<Place>> places;
  for (std::uint8_t m = 0; m < load.motors; ++m) places.push_back(places_of_steps(increment(m)));
  const bushd_report before = master_.poll(kAddress);
  const TimeNs before_ns = bus_.now_ns();
  begin_line(before.tick + 24);
  pass_until_made(load.ramp);
  EXPECT_EQ(master_.poll(kAddress).moving, (1u << load.motors) - 1u);
  const bushd_report after =
      answer_until(end_of_run_ns(load.ramp, places[0].back()), load.ramp.poll_ms);
  expect_no_late_tick(before, after, bus_.now_ns() - before_ns, load.ramp.tick_ns);
  ASSERT_NO_FATAL_FAILURE(expect_steps_in_slots(places, load.ramp.tick_ns));
  for (std::uint8_t m = 0; m < load.motors; ++m) {
    const auto steps = static_cast<int>(increment(m));
    EXPECT_EQ(after.motor[m].position_steps, is_forward(m) ? steps : -steps);
  }
}

// At least 9 steps of the run a tick of which docs/performance.md tells (see table_runs_test.cpp),
// by ramps of 238 codes, which is as fast as it takes; polled as by bushd.
std::vector<LineLoad> line_loads() {
  std::vector<LineLoad> loads;
  for (int phase = 0; phase < 4; ++phase) {
    loads.push_back({{BUSHD_FORMAT_COARSE, 2'464'000, 1'000, 270, 50, phase}, 16, 7});
    loads.push_back({{BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 50, phase}, 16, 7});
  }
  // All with the run; and few steps of most.
  loads.push_back({{BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 50}, 16, 0});
  loads.push_back({{BUSHD_FORMAT_COARSE, 2'464'000, 1'000, 270, 50}, 16, 199});
  // More steps of the run than are kept at a time, in a tick that is no whole number of time units.
  loads.push_back({{BUSHD_FORMAT_FINE, 18'000'000, 7'000, 39, 50}, 16, 61});
  // The shortest tick.
  loads.push_back({{BUSHD_FORMAT_COARSE, 2'400'000, 1'000, 270, 50}, 16, 7});
  return loads;
}

INSTANTIATE_TEST_SUITE_P(Loads, AvrLineRuns, testing::ValuesIn(line_loads()), [](auto& of) {
  const LineLoad& load = of.param;
  return name_of(load.ramp,
                 std::to_string(load.motors) + "Motors" + std::to_string(load.apart) + "Apart");
});

}  // namespace
}  // namespace bushd::sim::line_runs_test
