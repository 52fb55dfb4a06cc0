// Codes as they are written: they rise and fall in any order, every step comes after its own, and
// whatever stops the motor in them, it ramps down by its own table.
#include <numeric>
#include <random>

#include "firmware/programs.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kWrittenBank = BUSHD_SCRATCH_BANK;
constexpr std::uint8_t kWritten = 1;
constexpr std::uint16_t kWrittenBit = 1 << kWritten;
constexpr std::uint16_t kWrittenLeft = 1 << 2;

class WrittenCodes : public Programs {
 protected:
  // Up to 4 ms, and never faster than the motor's own table.
  static Law any_codes(unsigned seed, std::size_t up, std::size_t down) {
    std::mt19937 random(seed);
    Law codes;
    codes.unit_ns = 10'000;
    const auto any = [&] { return static_cast<std::uint16_t>(80 + random() % 320); };
    for (std::size_t i = 0; i < up; ++i) codes.accel.push_back(any());
    for (std::size_t i = 0; i < down; ++i) codes.decel.push_back(any());
    codes.cruise = any();
    return codes;
  }
  // The delay before each step.
  static std::vector<std::int64_t> delays(const Law& codes, std::size_t steps) {
    std::vector<std::int64_t> all;
    for (const std::uint16_t code : codes.accel) all.push_back(code);
    while (all.size() + codes.decel.size() < steps) all.push_back(codes.cruise);
    all.insert(all.end(), codes.decel.rbegin(), codes.decel.rend());
    for (std::int64_t& delay : all) delay *= codes.unit_ns;
    return all;
  }
  ProgramText line(std::int32_t steps) const {
    return {
        .motors = kWrittenBit,
        .frames = {
            {.kind = Kind::kLineBy, .motors = {kWritten}, .to = {{steps}}, .bank = kWrittenBank},
            kProgramEnd}};
  }
  ProgramText travel(std::int32_t steps) const {
    return {.motors = kWrittenBit,
            .frames = {{.kind = Kind::kTravel,
                        .motors = {kWritten},
                        .to = {{steps}},
                        .us = 20'000,
                        .bank = kWrittenBank},
                       kProgramEnd}};
  }
  void between_limits(std::int64_t way) {
    EXPECT_EQ(rig.set_inputs({.limit_positive = kWrittenBit, .limit_negative = kWrittenBit}),
              BUSHD_OK);
    EXPECT_EQ(rig.motor_inputs({kWritten, 1, 2, 1}), BUSHD_OK);
    rig.sense = [this, way] {
      unsigned active = 0;
      if (rig.pulses(kWritten) >= way) active |= kWrittenBit;
      if (rig.pulses(kWritten) <= 0) active |= kWrittenLeft;
      return bushd_inputs{static_cast<std::uint16_t>(active), 0};
    };
    rig.pass(2);
  }
  std::int64_t expect(std::int64_t at_ns, const std::vector<std::int64_t>& after, bool positive) {
    for (const std::int64_t delay : after) {
      at_ns += delay;
      const std::int64_t slot =
          at_ns % kTick == 0 ? at_ns / kTick * kSlots - 1 : at_ns * kSlots / kTick;
      expected.insert({static_cast<std::uint32_t>(slot / kSlots),
                       static_cast<std::uint16_t>(slot % kSlots), kWritten, positive});
    }
    return at_ns;
  }
  // What was to be made by `after`, from the beginning of tick `first` on, and was stopped from
  // tick `from` on: the running step, then the fewest that the motor's own table has from there.
  void expect_own_ramp(std::uint32_t first, const std::vector<std::int64_t>& after,
                       std::uint32_t from, std::int64_t tolerance_ns) {
    std::int64_t due_ns = first * kTick;
    std::size_t running = 0;
    while ((due_ns += after[running]) <= from * kTick) ++running;
    const std::int64_t unit_ns = law.unit_ns;
    const std::int64_t own = (after[running] + unit_ns - 1) / unit_ns;
    std::size_t k = 0;
    while (k < law.decel.size() && law.decel[k] > own) ++k;
    ASSERT_EQ(made.size(), running + 1 + k);
    auto step = std::next(made.begin(), static_cast<std::ptrdiff_t>(running));
    const auto at_ns = [&] { return (step->tick * kSlots + step->slot) * kTick / kSlots; };
    EXPECT_GE(at_ns(), due_ns - kTick / kSlots) << "the running step is no sooner";
    for (std::int64_t before_ns = at_ns(); k > 0; --k, before_ns = at_ns()) {
      ++step;
      EXPECT_NEAR(static_cast<double>(at_ns() - before_ns),
                  static_cast<double>(law.decel[k - 1] * unit_ns),
                  static_cast<double>(tolerance_ns));
    }
  }

  std::set<MadeStep> expected;
};
BUSHD_IN_BOTH_FORMATS(WrittenCodes);

TEST_P(WrittenCodes, EveryEdgeOfALineIsWhereTheyPutIt) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Law codes = any_codes(seed, 1 + seed * 7 % 60, 1 + seed * 5 % 40);
    const std::size_t steps = codes.accel.size() + codes.decel.size() + (seed % 2 == 0 ? 50 : 0);
    ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
    made.clear(), expected.clear();
    const bool back = seed % 3 == 0;
    const auto way = static_cast<std::int32_t>(steps);
    ASSERT_EQ(load(line(back ? -way : way)), BUSHD_OK);
    const std::uint32_t first = rig.first_open() + 2;
    ASSERT_EQ(start(first), BUSHD_OK);
    expect_ended(BUSHD_PROGRAM_DONE);
    expect(first * kTick, delays(codes, steps), !back);
    ASSERT_EQ(made, expected) << seed;
  }
}

TEST_P(WrittenCodes, EveryEdgeOfATravelIsWhereTheyPutIt) {
  const Law codes = any_codes(3, 40, 1);
  between_limits(41);
  ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
  ASSERT_EQ(load(travel(41)), BUSHD_OK);
  const std::uint32_t first = rig.first_open() + 2;
  ASSERT_EQ(start(first), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  const std::int64_t end_ns = expect(first * kTick, delays(codes, 41), true);
  expect(end_ns + 20'000'000, delays(codes, 41), false);
  EXPECT_EQ(made, expected);
}

// What a table could have is one, though it is no motor's: a run of fewer steps has its rule.
TEST_P(WrittenCodes, ATravelMayGoByATableThatIsNotItsMotors) {
  Law other = law;
  for (std::uint16_t& code : other.accel) code = static_cast<std::uint16_t>(code * 5 / 4);
  between_limits(30);
  ASSERT_EQ(rig.upload(kWrittenBank, other), BUSHD_OK);
  ASSERT_EQ(load(travel(30)), BUSHD_OK);
  const std::uint32_t first = rig.first_open() + 2;
  ASSERT_EQ(start(first), BUSHD_OK);
  expect_ended(BUSHD_PROGRAM_DONE);
  const auto run = Reference::move(other, 30);
  std::vector<std::int64_t> delays;
  for (std::size_t i = 0; i < 30; ++i) {
    delays.push_back(static_cast<std::int64_t>(run.step(i).delay / 256));
  }
  const std::int64_t end_ns = expect(first * kTick, delays, true);
  expect(end_ns + 20'000'000, delays, false);
  EXPECT_EQ(made, expected);
}

TEST_P(WrittenCodes, AStopInThemRampsDownByTheMotorsOwnTable) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    const Law codes = any_codes(seed, 60, 60);
    const bool travels = seed % 2 == 0;
    rig.sense = nullptr;
    if (travels) {
      ASSERT_EQ(rig.set_inputs({.limit_positive = kWrittenBit, .limit_negative = kWrittenBit}),
                BUSHD_OK);
      ASSERT_EQ(rig.motor_inputs({kWritten, 1, 2, 1}), BUSHD_OK);
    }
    ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
    made.clear();
    ASSERT_EQ(load(travels ? travel(120) : line(120)), BUSHD_OK);
    const std::uint32_t first = rig.first_open() + 2;
    ASSERT_EQ(start(first), BUSHD_OK);
    pass(static_cast<int>(20 + seed * 3));
    const std::uint32_t from = rig.first_open();
    if (seed % 3 == 0) {
      rig.emergency(BUSHD_STOP_RAMP);
      expect_ended(BUSHD_PROGRAM_FAULT);
      EXPECT_EQ(rig.clear(0xFF), BUSHD_OK);
    } else {
      ASSERT_EQ(control(BUSHD_PROGRAM_STOP, 0, BUSHD_STOP_RAMP), BUSHD_OK);
      expect_ended(BUSHD_PROGRAM_STOPPED);
    }
    // A line is left as a stream is, whose steps in a tick are evenly spaced.
    expect_own_ramp(first, delays(codes, 120), from, travels ? 2 * kTick / kSlots : kTick);
  }
}

TEST_P(WrittenCodes, ALimitAndSilenceStopThemToo) {
  const Law codes = any_codes(5, 60, 60);
  between_limits(30);
  ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
  begin(line(120));
  expect_ended(BUSHD_PROGRAM_LIMIT);
  EXPECT_GE(rig.pulses(kWritten), 30);
  EXPECT_LT(rig.pulses(kWritten), 30 + 12);
  rig.sense = nullptr;
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 20), BUSHD_OK);
  ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
  begin(line(-120));
  expect_ended(BUSHD_PROGRAM_SILENCE);
  EXPECT_GT(rig.pulses(kWritten), -90);
}

TEST_P(WrittenCodes, AreForOneMotorAndItsWholeRun) {
  const Law codes = any_codes(5, 60, 60);
  ASSERT_EQ(rig.upload(0, codes), BUSHD_E_TABLE_UNSORTED) << "no motor's table";
  rig.make_ready(law, format, 3000);
  ASSERT_EQ(rig.upload(kWrittenBank, codes), BUSHD_OK);
  begin(line(119));
  expect_ended(BUSHD_PROGRAM_REFUSED);
  ProgramText two = line(120);
  two.motors = 3;
  two.frames.front().motors = {0, 1};
  two.frames.front().to = {{120, 120}};
  begin(two);
  expect_ended(BUSHD_PROGRAM_REFUSED);
  ProgramText slower = line(120);
  slower.frames.front().shortest_delay = 500;
  begin(slower);
  expect_ended(BUSHD_PROGRAM_REFUSED);
  ASSERT_EQ(load(travel(119)), BUSHD_OK);
  EXPECT_EQ(start(rig.first_open()), BUSHD_E_FORMAT);
  Law zero = codes;
  zero.decel[3] = 0;
  EXPECT_EQ(rig.upload(kWrittenBank, zero), BUSHD_E_TABLE_ZERO);
}

// They would begin anew from where they stand, or have too few steps left.
TEST_P(WrittenCodes, AreNotPaused) {
  ASSERT_EQ(rig.upload(kWrittenBank, any_codes(7, 20, 10)), BUSHD_OK);
  ASSERT_EQ(load(line(120)), BUSHD_OK);
  ASSERT_EQ(start(rig.first_open()), BUSHD_OK);
  pass(30);
  EXPECT_EQ(control(BUSHD_PROGRAM_PAUSE), BUSHD_E_STATE);
  expect_ended(BUSHD_PROGRAM_DONE);
  EXPECT_EQ(rig.pulses(kWritten), 120);
}

}  // namespace
}  // namespace bushd::test
