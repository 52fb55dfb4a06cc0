// A line (LINE_RUN) on the image for ATmega2560: its motors follow one run, asked for their reports
// meanwhile. Every step must be in its slot, and no tick late.
#include <algorithm>
#include <array>

#include "sim/avr/avr_fixture.h"
#include "sim/avr/ramps.h"

namespace bushd::sim::line_runs_test {
namespace {

constexpr std::int64_t kSlots = 128;
constexpr std::uint32_t kLongest = 3000;

struct LineLoad {
  bushd_format format;
  std::uint32_t tick_ns;
  std::uint32_t unit_ns;
  std::uint16_t cruise;  // in units
  std::uint8_t motors;
  std::uint32_t apart;    // each motor makes so many steps less than the one before
  std::uint32_t poll_ms;  // 0: nothing is asked meanwhile
  int phase = 0;          // in which polls meet the ticks
};

class AvrLineRuns : public AvrAlone, public testing::WithParamInterface<LineLoad> {
 protected:
  static std::vector<std::uint16_t> line_codes() { return ramp_to(GetParam().cruise); }

  static std::uint32_t increment(std::uint8_t motor) { return kLongest - GetParam().apart * motor; }
  static bool is_forward(std::uint8_t motor) { return motor % 3 != 1; }

  struct Place {
    std::int64_t slot;  // from the run's start
    bool at_border;     // a hundredth of a slot later it is in the next one
  };

  // Where each step of a motor falls: step j at ceil(128 (2j - 1) L / N) + 128 parts of 1/256 step
  // of the run, whose step k comes after the delays of ramps.h. One at a tick's end
  // falls into its last slot.
  static std::vector<Place> places_of_steps(std::uint32_t increment) {
    std::vector<std::int64_t> begins{0};
    for (const std::uint16_t units : delays_of_run(GetParam().cruise, kLongest)) {
      begins.push_back(begins.back() + std::int64_t{units} * GetParam().unit_ns);
    }
    const std::int64_t slot_time = 256 * std::int64_t{GetParam().tick_ns};
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
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    payload.resize(
        bushd_encode_line_run(&message, entries.data(), GetParam().motors, payload.data()));
    master_.post(kAddress, BUSHD_MSG_LINE_RUN, payload);
  }

  // All pulses begin within the time of one slot, counted from where theirs does. A place may be
  // told a hundredth of a slot late (docs/protocol.md).
  void expect_steps_in_slots() const {
    const auto time_of = [](std::int64_t slot) { return slot * GetParam().tick_ns / kSlots; };
    const TimeNs slot_ns = time_of(1);
    TimeNs earliest_ns = 0;
    TimeNs latest_ns = 0;
    TimeNs begin_ns = 0;
    for (std::uint8_t m = 0; m < GetParam().motors; ++m) {
      SCOPED_TRACE("motor " + std::to_string(m));
      const std::vector<TimeNs> made = recorder_.times(0, Signal::kStep, m, true);
      const std::vector<Place> places = places_of_steps(increment(m));
      ASSERT_EQ(made.size(), places.size());
      if (m == 0) begin_ns = made[0] - time_of(places[0].slot);
      for (std::size_t i = 0; i < places.size(); ++i) {
        TimeNs late_ns = made[i] - begin_ns - time_of(places[i].slot);
        if (places[i].at_border && late_ns > slot_ns / 2) late_ns -= slot_ns;
        earliest_ns = std::min(earliest_ns, late_ns);
        latest_ns = std::max(latest_ns, late_ns);
        ASSERT_LT(latest_ns - earliest_ns, slot_ns) << "step " << i;
      }
    }
  }
};

TEST_P(AvrLineRuns, KeepTheirSlots) {
  const LineLoad& load = GetParam();
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(master_.bring_up(load.tick_ns, load.format));
  ASSERT_NO_FATAL_FAILURE(
      master_.upload_table(kAddress, 0, load.unit_ns, line_codes(), load.cruise));
  ASSERT_NO_FATAL_FAILURE(master_.assign_all(kAddress, 0));
  const bushd_report before = master_.poll(kAddress);
  const TimeNs before_ns = bus_.now_ns();
  begin_line(before.tick + 24);
  // As in table_runs_test.cpp.
  pass(8 * TimeNs{load.tick_ns} + load.phase * 61'000);
  EXPECT_EQ(master_.poll(kAddress).moving, (1u << load.motors) - 1u);
  const auto ticks = places_of_steps(kLongest).back().slot / kSlots + 1;
  const TimeNs end_ns = bus_.now_ns() + static_cast<TimeNs>(ticks + 40) * load.tick_ns;
  const bushd_report after = answer_until(end_ns, load.poll_ms);
  expect_no_late_tick(before, after, bus_.now_ns() - before_ns, load.tick_ns);
  ASSERT_NO_FATAL_FAILURE(expect_steps_in_slots());
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
    loads.push_back({BUSHD_FORMAT_COARSE, 2'464'000, 1'000, 270, 16, 7, 50, phase});
    loads.push_back({BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 16, 7, 50, phase});
  }
  // All with the run; and few steps of most.
  loads.push_back({BUSHD_FORMAT_FINE, 2'464'000, 1'000, 270, 16, 0, 50});
  loads.push_back({BUSHD_FORMAT_COARSE, 2'464'000, 1'000, 270, 16, 199, 50});
  // More steps of the run than are kept at a time, in a tick that is no whole number of time units.
  loads.push_back({BUSHD_FORMAT_FINE, 18'000'000, 7'000, 39, 16, 61, 50});
  // The shortest tick.
  loads.push_back({BUSHD_FORMAT_COARSE, 2'400'000, 1'000, 270, 16, 7, 50});
  return loads;
}

std::string name_of_line(const testing::TestParamInfo<LineLoad>& load) {
  return (load.param.format == BUSHD_FORMAT_FINE ? "Fine" : "Coarse") +
         std::to_string(load.param.tick_ns / 1000) + "us" + std::to_string(load.param.motors) +
         "Motors" + std::to_string(load.param.apart) + "Apart" +
         (load.param.poll_ms != 0 ? "Answering" : "") +
         (load.param.phase != 0 ? "Phase" + std::to_string(load.param.phase) : "");
}

INSTANTIATE_TEST_SUITE_P(Loads, AvrLineRuns, testing::ValuesIn(line_loads()), name_of_line);

}  // namespace
}  // namespace bushd::sim::line_runs_test
