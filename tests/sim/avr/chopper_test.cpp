// The chopper of the ATmega1284P with a power stage and windings behind its pins: currents over
// speed, in ramps, at constant speed and at rest, with both decays.
#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/avr/avr_fixture.h"

namespace bushd::sim::chopper_test {
namespace {

constexpr TimeNs kPeriodNs = 25'000;

// A cut: a winding goes off that comes on again within the chopper's period.
struct Figures {
  std::size_t cuts = 0;
  double least_a = 99;  // at a cut
  double most_a = 0;
  double ripple_a = 0;  // most that the current falls until it is on again
};

class Chopper : public Atmega1284pAlone {
 protected:
  static constexpr std::uint16_t kRampMa = 1500;
  static constexpr std::uint16_t kCruiseMa = 1000;
  static constexpr std::uint16_t kHoldMa = 300;

  void make_ready(bushd_phase_sequence sequence, bushd_decay decay, std::uint16_t cruise_units) {
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, BUSHD_FORMAT_FINE));
    ASSERT_NO_FATAL_FAILURE(emit_phases(sequence));
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_currents{0, static_cast<std::uint8_t>(decay),
                                                            kRampMa, kCruiseMa, kHoldMa}),
              BUSHD_OK);
    std::vector<std::uint16_t> ramp;
    // 10 us a unit; steps at constant acceleration from 5 ms on.
    for (double units = 500; units > cruise_units; units /= std::sqrt(1 + 2 * 50 / units)) {
      ramp.push_back(static_cast<std::uint16_t>(units));
    }
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, ramp, cruise_units));
    ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, 0, 0));
  }

  // Figures of what was recorded since `forget`.
  Figures figures() const;
  void forget() {
    recorder_.samples.clear();
    recorder_.edges.clear();
  }

  const PowerStageRules rules_{};
};

Figures Chopper::figures() const {
  Figures found;
  // Not known until the first sample of what is recorded.
  std::array<std::optional<double>, PowerStage::kWindings> now_a{};
  std::array<std::optional<double>, PowerStage::kWindings> cut_a{};
  std::array<TimeNs, PowerStage::kWindings> cut_ns{};
  auto sample = recorder_.samples.begin();
  for (const Edge& edge : recorder_.edges) {
    if (edge.signal != Signal::kStep || edge.index >= PowerStage::kWindings) continue;
    for (; sample != recorder_.samples.end() && sample->time_ns <= edge.time_ns; ++sample) {
      now_a[sample->winding] = sample->value;
    }
    const std::size_t w = edge.index;
    if (!edge.level) {
      cut_a[w] = now_a[w];
      cut_ns[w] = edge.time_ns;
    } else if (cut_a[w] && edge.time_ns - cut_ns[w] < kPeriodNs) {
      ++found.cuts;
      found.least_a = std::min(found.least_a, *cut_a[w]);
      found.most_a = std::max(found.most_a, *cut_a[w]);
      found.ripple_a = std::max(found.ripple_a, *cut_a[w] - *now_a[w]);
    }
  }
  return found;
}

struct Drive {
  bushd_phase_sequence sequence;
  bushd_decay decay;
  std::uint16_t cruise_units;  // of 10 us, a step

  friend void PrintTo(const Drive& drive, std::ostream* out) {
    *out << "sequence " << drive.sequence << ", decay " << drive.decay << ", "
         << 100'000 / drive.cruise_units << " steps/s";
  }
};

class ChopperAtSpeed : public Chopper, public testing::WithParamInterface<Drive> {
 protected:
  void cruise() {
    const Drive& drive = GetParam();
    ASSERT_NO_FATAL_FAILURE(make_ready(drive.sequence, drive.decay, drive.cruise_units));
    run(0, 4000);
    pass(450'000'000);
    forget();
    pass(60'000'000);
  }
  double back_emf_v() const {
    const double hz = 1e5 / GetParam().cruise_units;
    return rules_.back_emf_v_per_hz * (GetParam().sequence == BUSHD_PHASES_HALF ? hz / 2 : hz);
  }
};

// Each cut, not only on the average. Of 50 mA ten stem from the 256ths of 5.11 A, and three from
// the comparator's interrupt, which may wait for a slot's: 1 us of 24 V at 8 mH is 3 mA.
TEST_P(ChopperAtSpeed, CutsEveryWindingAtItsCurrent) {
  ASSERT_NO_FATAL_FAILURE(cruise());
  const Figures found = figures();
  const double set_a = kCruiseMa / 1000.0;
  EXPECT_GT(found.cuts, 500u);
  EXPECT_GE(found.least_a, 0.95 * set_a);
  EXPECT_LE(found.most_a, 1.05 * set_a);
  // It falls for less than a period, by what its winding, the diodes, the supply with fast decay,
  // and at worst all of the back EMF make of it.
  const bool fast = GetParam().decay == BUSHD_DECAY_FAST;
  const double against_v = fast ? rules_.supply_v + 2 * rules_.diode_v : rules_.diode_v;
  const double volt = against_v + found.most_a * rules_.resistance_ohm + back_emf_v();
  const double most_ripple_a = volt / rules_.inductance_h * kPeriodNs * 1e-9;
  EXPECT_LE(found.ripple_a, most_ripple_a);
  // A cut in the first half of the period leaves the other half to fall in.
  EXPECT_GE(found.ripple_a, most_ripple_a / 2);
  testing::Test::RecordProperty("least_ma", static_cast<int>(found.least_a * 1000));
  testing::Test::RecordProperty("most_ma", static_cast<int>(found.most_a * 1000));
  testing::Test::RecordProperty("ripple_ma", static_cast<int>(found.ripple_a * 1000));
}

INSTANTIATE_TEST_SUITE_P(Drives, ChopperAtSpeed,
                         testing::Values(Drive{BUSHD_PHASES_WAVE, BUSHD_DECAY_SLOW, 400},
                                         Drive{BUSHD_PHASES_WAVE, BUSHD_DECAY_FAST, 100},
                                         Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_SLOW, 200},
                                         Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_FAST, 200},
                                         // Here comparators fall while phases change.
                                         Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_SLOW, 300},
                                         Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_FAST, 300},
                                         Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_FAST, 90},
                                         Drive{BUSHD_PHASES_HALF, BUSHD_DECAY_SLOW, 60},
                                         Drive{BUSHD_PHASES_HALF, BUSHD_DECAY_FAST, 40}));

// "Because of the back EMF, with little voltage at the winding while its current falls, the mean
// current may be too much": fast decay is for such speeds.
class ChopperTooFast : public ChopperAtSpeed {};
TEST_P(ChopperTooFast, SlowDecayLeavesMoreThanIsSet) {
  ASSERT_NO_FATAL_FAILURE(cruise());
  const Figures found = figures();
  EXPECT_GT(found.cuts, 500u);
  EXPECT_GT(found.most_a, 1.2 * kCruiseMa / 1000);
}
INSTANTIATE_TEST_SUITE_P(Drives, ChopperTooFast,
                         testing::Values(Drive{BUSHD_PHASES_FULL, BUSHD_DECAY_SLOW, 60}));

TEST_F(Chopper, RampsCruiseAndRestHaveTheirCurrents) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_PHASES_HALF, BUSHD_DECAY_FAST, 100));
  const auto expect_current = [&](std::uint16_t ma, TimeNs ns) {
    SCOPED_TRACE(std::to_string(ma) + " mA");
    forget();
    pass(ns);
    const Figures found = figures();
    // What it falls by in a period after a cut it rises by in a little more than one, so each
    // second period has a cut. One that leaves the winding off for a whole period is not told from
    // a change of phases, and does not count; the next one, which comes later in its period, does.
    EXPECT_GE(found.cuts, static_cast<std::size_t>(ns / kPeriodNs / 4));
    EXPECT_GE(found.least_a, ma * 0.95e-3);
    EXPECT_LE(found.most_a, ma * 1.05e-3);
  };
  pass(100'000'000);
  expect_current(kHoldMa, 20'000'000);
  const std::uint32_t first = master_.poll(kAddress).tick + 24;
  run(0, 600);
  // Three ticks into the ramp the reference is there.
  while (static_cast<std::int32_t>(master_.poll(kAddress).tick - first) < 3) pass(kTickNs);
  expect_current(kRampMa, 30'000'000);
  pass(350'000'000);
  expect_current(kCruiseMa, 20'000'000);
  EXPECT_NE(master_.poll(kAddress).moving, 0);
  pass(700'000'000);
  EXPECT_EQ(master_.poll(kAddress).moving, 0);
  expect_current(kHoldMa, 20'000'000);
  EXPECT_EQ(master_.poll(kAddress).motor[0].position_steps, 600);
}

// Fast PWM that does not invert is high for OCR2A + 1 of 256 counts (data sheet of the ATmega1284P,
// "Fast PWM Mode": set at BOTTOM, cleared on compare match), and high for good is 5.11 A. So what
// is set is met to half of a 256th, from one of them on. After 10 ms, 33 time constants, the filter
// is there.
TEST_F(Chopper, TheReferenceIsTheCurrentThatIsSet) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_PHASES_HALF, BUSHD_DECAY_FAST, 100));
  constexpr double kCountA = 5.11 / 256;
  constexpr std::uint16_t kSetMa[] = {1, 20, 29, 31, 40, 100, 300, 1000, 1019, 2555, 5090, 5110};
  for (const std::uint16_t ma : kSetMa) {
    SCOPED_TRACE(std::to_string(ma) + " mA");
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_currents{0, BUSHD_DECAY_FAST, ma, ma, ma}),
              BUSHD_OK);
    pass(10'000'000);
    EXPECT_NEAR(avr_->power_stage().reference_a(), std::max(ma / 1000.0, kCountA),
                kCountA / 2 + 1e-6);
  }
}

// What is set is kept, and refused where it cannot be.
TEST_F(Chopper, OnlyMotor0HasOne) {
  ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_PHASES_HALF, BUSHD_DECAY_FAST, 100));
  const auto ask = [&](const bushd_currents& message) {
    return master_.acknowledged(kAddress, message);
  };
  EXPECT_EQ(ask({1, BUSHD_DECAY_SLOW, 100, 100, 100}), BUSHD_E_FORMAT);
  run(0, 100);
  pass(100'000'000);
  EXPECT_EQ(ask({0, BUSHD_DECAY_SLOW, 100, 100, 100}), BUSHD_E_STATE);
  pass(700'000'000);
  EXPECT_EQ(ask({0, BUSHD_DECAY_SLOW, 0, 0, 0}), BUSHD_OK);
  forget();
  pass(50'000'000);
  EXPECT_EQ(figures().cuts, 0u) << "no current is controlled";
}

}  // namespace
}  // namespace bushd::sim::chopper_test
