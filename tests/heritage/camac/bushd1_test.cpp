// BUSHD-1. What the report of 1985 says, by the numbers of docs/camac.md, is in the names' order
// there.
#include "heritage/camac/bushd1.h"

#include <gtest/gtest.h>

#include "heritage/camac/bench.h"

namespace bushd::camac::bushd1_test {
namespace {

constexpr std::uint32_t kLeft = 0x08;
constexpr std::uint32_t kAutomatic = 0x40;
constexpr std::uint32_t kSecondMode = 0x80;  // with the sensor; synchronous
constexpr std::uint32_t kAllEnabled = 0x37;

enum Request : std::uint32_t {
  kRightLimit = 0x01,
  kLeftLimit = 0x02,
  kStepDone = 0x04,
  kStepNotDone = 0x08,
  kTravelFailed = 0x10,
  kOverflow = 0x20,
  kRightLevel = 0x40,
  kLeftLevel = 0x80
};

class Bushd1Bench : public Commands<Bushd1> {
 public:
  explicit Bushd1Bench(AdjustableDelay adjusts = AdjustableDelay::kReturn)
      : module(shutter, adjusts) {
    crate.insert(kStation, module);
  }
  // Steps with these delays, and the delay of the return.
  void load(const std::vector<int>& codes, int return_delay = 20'000) {
    std::vector<int> bytes{static_cast<int>(codes.size()), 0, return_delay % 256,
                           return_delay / 256};
    for (const int code : codes) {
      bytes.push_back(code % 256);
      bytes.push_back(code / 256);
    }
    write_at(0, bytes);
  }
  // Travels from the right limit to the left one, with all requests enabled.
  void depart(std::uint32_t mode = kAutomatic) {
    load({300, 200, 100, 200});
    module.limits(true, false);
    permit(mode | kLeft | kAllEnabled);
  }
  // A run of four steps that ends at the limit switch of its direction.
  void run(bool left) {
    module.run_step_done();
    module.limits(false, false);
    for (int i = 0; i < 3; ++i) module.run_step_done();
    module.limits(!left, left);
    module.run_ends();
  }

  ShutterBench shutter;
  Bushd1 module;
};

TEST(Bushd1, AnswersElevenCommands) {  // S4, S6, U5
  Bushd1Bench bench;
  EXPECT_EQ(text(bench.cycle(1, 16, 0xFFFFFF)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(1, 0)), "X Q 255");
  EXPECT_EQ(text(bench.cycle(2, 16, 0xFFFFA5)), "X Q 0");
  EXPECT_EQ(text(bench.cycle(2, 0)), "X Q 165");
  EXPECT_EQ(text(bench.cycle(0, 16, 0x17F)), "X Q 0");
  EXPECT_EQ(bench.address(), 0U) << "8 bits, and the last address is followed by 0";
  bench.set_address(255);
  bench.clear_lam();
  EXPECT_EQ(text(bench.cycle(0, 0)), "X Q 127");
  EXPECT_EQ(text(bench.cycle(3, 0)), "X Q 32");
  EXPECT_EQ(text(bench.cycle(0, 8)), "X Q 0") << "S9: bit 6 enables it";
  EXPECT_EQ(text(bench.cycle(0, 10)), "X - 0");
  EXPECT_EQ(text(bench.cycle(0, 24)), "X - 0");
  EXPECT_EQ(text(bench.cycle(0, 26)), "X - 0");
  int accepted = 0;
  for (int a = 0; a < 16; ++a) {
    for (int f = 0; f < 32; ++f) accepted += bench.cycle(a, f).x ? 1 : 0;
  }
  EXPECT_EQ(accepted, 11);
}

TEST(Bushd1, QOfMemoryIsNotLam) {  // S5, U1, U4
  Bushd1Bench bench;
  bench.set_control(kOverflow);
  bench.set_address(255);
  EXPECT_TRUE(bench.read().q);
  EXPECT_FALSE(bench.read().q);
  EXPECT_EQ(bench.address(), 1U);
  bench.clear_lam();
  EXPECT_TRUE(bench.read().q);
}

TEST(Bushd1, OpensTheBeamADelayAfterTheReactorStart) {  // S7, S8, S18, U9, U10
  Bushd1Bench bench;
  bench.depart(kAutomatic | kSecondMode);
  ASSERT_EQ(bench.shutter.travels.size(), 1U);
  const Travel& travel = bench.shutter.travels[0];
  EXPECT_TRUE(travel.synchronous);
  EXPECT_EQ(travel.first_run_us(1'000'000), 1'150'000);
  EXPECT_EQ(travel.step_us(0), 300 * 50) << "a delay stands before its step";
  EXPECT_EQ(travel.step_us(3), 800 * 50);
  EXPECT_EQ(travel.return_delay_us(), 1'000'000);
  EXPECT_EQ(travel.return_us(1'000'000, 1'190'000), 2'000'000) << "U13";
  EXPECT_EQ(travel.return_us(1'000'000, 2'500'000), 2'500'000) << "not before it has arrived";
}

// The other reading of U13.
TEST(Bushd1, TheAdjustableDelayMayBeThatOfTheOpening) {  // S7, S18
  Bushd1Bench bench(AdjustableDelay::kOpening);
  bench.depart(kAutomatic | kSecondMode);
  ASSERT_EQ(bench.shutter.travels.size(), 1U);
  const Travel& travel = bench.shutter.travels[0];
  EXPECT_EQ(travel.first_run_us(1'000'000), 2'000'000);
  EXPECT_EQ(travel.return_us(1'000'000, 1'060'000), 1'150'000);
  EXPECT_EQ(travel.return_us(1'000'000, 2'040'000), 2'040'000) << "not before it has arrived";

  Bushd1Bench alone(AdjustableDelay::kOpening);
  alone.depart(kAutomatic);
  ASSERT_EQ(alone.shutter.travels.size(), 1U);
  EXPECT_EQ(alone.shutter.travels[0].return_us(0, 700'000), 1'700'000)
      << "U14: without reactor starts it is that of the return";
}

TEST(Bushd1, DelaysAreFrom50UsTo1500Ms) {  // S18, U9
  Bushd1Bench bench;
  bench.load({65535, 0, 0, 30'001}, 0);
  bench.permit(kAutomatic);
  const Travel& travel = bench.shutter.travels.at(0);
  EXPECT_EQ(travel.codes, (std::vector<std::uint16_t>{30'000, 1, 1, 30'000}));
  EXPECT_EQ(travel.step_us(0), 1'500'000);
  EXPECT_EQ(travel.return_delay_us(), 50);
}

TEST(Bushd1, EachRequestHasItsEnable) {  // S9, S10, S12
  struct Case {
    std::uint32_t request;
    std::uint32_t enable;
    std::function<void(Bushd1Bench&)> cause;
  };
  const auto step = [](Bushd1Bench& bench) { bench.permit(kSecondMode); };
  const Case cases[]{{kRightLimit, 0x01,
                      [&](Bushd1Bench& b) {
                        step(b);
                        b.module.limits(true, false);
                        b.module.limits(false, false);
                      }},
                     {kLeftLimit, 0x02,
                      [&](Bushd1Bench& b) {
                        step(b);
                        b.module.limits(false, true);
                        b.module.limits(false, false);
                      }},
                     {kStepDone, 0x04,
                      [&](Bushd1Bench& b) {
                        step(b);
                        b.module.step_done();
                      }},
                     {kStepNotDone, 0x10,
                      [&](Bushd1Bench& b) {
                        step(b);
                        b.module.step_not_done();
                      }},
                     {kTravelFailed, 0x10,
                      [](Bushd1Bench& b) {
                        b.permit(kAutomatic);  // no steps
                      }},
                     {kOverflow, 0x20, [](Bushd1Bench& b) {
                        b.set_address(255);
                        b.write(0);
                      }}};
  for (const Case& each : cases) {
    Bushd1Bench bench;
    each.cause(bench);
    EXPECT_EQ(bench.requests(), each.request);
    for (std::uint32_t bit = 1; bit < 0x40; bit <<= 1) {
      bench.set_control(bit);
      EXPECT_EQ(bench.lam(), bit == each.enable) << each.request << " by " << bit;
    }
    bench.clear_lam();
    EXPECT_EQ(bench.requests(), 0U);
    EXPECT_FALSE(bench.lam());
  }
}

TEST(Bushd1, Modes) {  // S11, U6
  const auto permitted = [](std::uint32_t mode) {
    Bushd1Bench bench;
    bench.load({9});
    bench.permit(mode);
    return std::pair{bench.shutter.steps, bench.shutter.travels};
  };
  const auto [plain, none] = permitted(0);
  ASSERT_EQ(plain.size(), 1U);
  EXPECT_FALSE(plain[0].with_sensor);
  EXPECT_TRUE(none.empty());
  const auto [sensed, none_either] = permitted(kSecondMode);
  ASSERT_EQ(sensed.size(), 1U);
  EXPECT_TRUE(sensed[0].with_sensor);
  EXPECT_TRUE(none_either.empty());
  EXPECT_FALSE(permitted(kAutomatic).second.at(0).synchronous);
  EXPECT_TRUE(permitted(kAutomatic | kSecondMode).second.at(0).synchronous);
}

TEST(Bushd1, LimitBitsAreLevels) {  // S12: 7, 8; U1, U12
  Bushd1Bench bench;
  bench.set_control(kAllEnabled);
  bench.module.limits(true, false);
  EXPECT_EQ(bench.requests(), kRightLevel) << "no request: nothing moves";
  EXPECT_FALSE(bench.lam());
  bench.clear_lam();
  EXPECT_EQ(bench.requests(), kRightLevel);
  bench.module.limits(false, true);
  EXPECT_EQ(bench.requests(), kLeftLevel);
}

TEST(Bushd1, MemoryHasStepsDelayAndCodes) {  // S13, D1
  Bushd1Bench bench;
  std::vector<int> codes(Bushd1::kMostSteps, 1000);
  bench.load(codes, 258);
  EXPECT_EQ(bench.address(), 0U) << "126 codes fill the memory";
  bench.permit(kAutomatic);
  EXPECT_EQ(bench.shutter.travels.at(0).codes.size(), 126U);
  EXPECT_EQ(bench.shutter.travels.at(0).delay, 258);
}

TEST(Bushd1, StepsOutOfRangeAreAFailure) {  // S13, U9
  for (const int steps : {0, 127, 255}) {
    Bushd1Bench bench;
    bench.write_at(0, {steps});
    bench.permit(kAutomatic);
    EXPECT_EQ(bench.requests(), kTravelFailed);
    EXPECT_TRUE(bench.shutter.travels.empty());
  }
}

TEST(Bushd1, CodesMayFollowAnyLaw) {  // S14
  EXPECT_TRUE(rise_and_fall_once({}));
  EXPECT_TRUE(rise_and_fall_once(std::vector<std::uint16_t>{5}));
  EXPECT_TRUE(rise_and_fall_once(std::vector<std::uint16_t>{5, 4, 4, 3, 3, 9}));
  EXPECT_TRUE(rise_and_fall_once(std::vector<std::uint16_t>{1, 2, 3}));
  EXPECT_FALSE(rise_and_fall_once(std::vector<std::uint16_t>{5, 4, 5, 4}));
  EXPECT_FALSE(rise_and_fall_once(std::vector<std::uint16_t>{1, 2, 1}));
  Bushd1Bench bench;
  bench.load({5, 4, 5, 4});
  bench.permit(kAutomatic);
  EXPECT_EQ(bench.requests(), 0u);
  EXPECT_EQ(bench.shutter.travels.at(0).codes, (std::vector<std::uint16_t>{5, 4, 5, 4}));
}

TEST(Bushd1, AutomaticTravelGoesThereAndBack) {  // S14, S15, S16, U14, U15
  Bushd1Bench bench;
  bench.depart();
  const Travel& travel = bench.shutter.travels.at(0);
  EXPECT_TRUE(travel.left);
  EXPECT_EQ(travel.return_us(0, 700'000), 1'700'000) << "the delay counts from arrival";
  bench.run(true);
  EXPECT_EQ(bench.requests(), kLeftLimit | kLeftLevel);
  EXPECT_TRUE(bench.lam());
  EXPECT_TRUE(bench.module.is_moving()) << "it returns by itself";
  bench.clear_lam();
  bench.run(false);
  EXPECT_EQ(bench.requests(), kRightLimit | kRightLevel);
  EXPECT_FALSE(bench.module.is_moving());
  EXPECT_EQ(bench.shutter.stops, 0);
}

TEST(Bushd1, SynchronousTravelRepeats) {  // S11: 11, U13
  Bushd1Bench bench;
  bench.depart(kAutomatic | kSecondMode);
  for (int start = 0; start < 3; ++start) {
    bench.run(true);
    bench.run(false);
    EXPECT_TRUE(bench.module.is_moving());
  }
  EXPECT_EQ(bench.shutter.travels.size(), 1U);
  bench.permit();
  EXPECT_EQ(bench.shutter.travels.size(), 1U) << "F26A0 while it waits has no effect";
  bench.forbid();
  EXPECT_EQ(bench.shutter.stops, 1);
  bench.module.stands();
  EXPECT_EQ(bench.requests() & kTravelFailed, 0U);
  EXPECT_FALSE(bench.module.is_moving());
}

TEST(Bushd1, ErrorsOfATravelStopIt) {  // S15, S17, U15
  struct Case {
    const char* what;
    std::function<void(Bushd1&)> happens;
  };
  const Case cases[]{{"limit not reached after the last step",
                      [](Bushd1& module) {
                        module.limits(false, false);
                        for (int i = 0; i < 4; ++i) module.run_step_done();
                        module.run_ends();
                      }},
                     {"limit reached before the last step",
                      [](Bushd1& module) {
                        module.run_step_done();
                        module.limits(false, true);
                      }},
                     {"limit active before the first step",
                      [](Bushd1& module) {
                        module.limits(false, true);
                        module.run_step_done();
                      }},
                     {"limit of departure still active",
                      [](Bushd1& module) {
                        for (int i = 0; i < 4; ++i) module.run_step_done();
                        module.limits(true, true);
                        module.run_ends();
                      }},
                     {"steps missing", [](Bushd1& module) {
                        module.limits(false, false);
                        module.run_step_done();
                        module.run_ends();
                      }}};
  for (const Case& each : cases) {
    Bushd1Bench bench;
    bench.depart();
    each.happens(bench.module);
    EXPECT_NE(bench.requests() & kTravelFailed, 0U) << each.what;
    EXPECT_TRUE(bench.lam()) << each.what;
    EXPECT_EQ(bench.shutter.stops, 1) << each.what;
    bench.clear_lam();
    bench.module.stands();
    EXPECT_FALSE(bench.module.is_moving()) << each.what;
    EXPECT_EQ(bench.requests() & kTravelFailed, 0U) << "told once: " << each.what;
  }
}

TEST(Bushd1, ErrorsAreToldWhateverIsEnabled) {  // S17, U3
  Bushd1Bench bench;
  bench.write_at(0, {127});
  bench.permit(kAutomatic);
  EXPECT_FALSE(bench.lam());
  EXPECT_EQ(bench.requests(), kTravelFailed);
  bench.set_control(0x10);
  EXPECT_TRUE(bench.lam());
}

TEST(Bushd1, DestinationThatIsActiveIsAFailure) {  // U15
  Bushd1Bench bench;
  bench.module.limits(false, true);
  bench.load({5, 5});
  bench.permit(kAutomatic | kLeft);
  EXPECT_EQ(bench.requests(), kTravelFailed | kLeftLevel);
  EXPECT_TRUE(bench.shutter.travels.empty());
}

TEST(Bushd1, SingleStepsEndByThemselves) {  // S11: 00, 01; U11
  EXPECT_EQ(SingleStep::kSensorUs, 1'500'000);
  Bushd1Bench bench;
  bench.permit(kSecondMode | kLeft);
  EXPECT_TRUE(bench.shutter.steps.at(0).left);
  bench.permit();
  EXPECT_EQ(bench.shutter.steps.size(), 1U);
  bench.module.step_done();
  EXPECT_EQ(bench.requests(), kStepDone);
  bench.permit();
  bench.module.step_not_done();
  EXPECT_EQ(bench.requests(), kStepDone | kStepNotDone);
}

TEST(Bushd1, AStepIntoAnActiveLimitIsRefused) {  // U11
  Bushd1Bench bench;
  bench.module.limits(true, true);
  bench.permit();
  bench.permit(kLeft);
  EXPECT_TRUE(bench.shutter.steps.empty());
  EXPECT_EQ(bench.requests(), kRightLimit | kLeftLimit | kRightLevel | kLeftLevel);
}

TEST(Bushd1, WhatCannotBeMadeIsAFailure) {
  Bushd1Bench bench;
  bench.shutter.accepts = false;
  bench.permit();
  EXPECT_EQ(bench.requests(), kStepNotDone);
  bench.load({5});
  bench.permit(kAutomatic);
  EXPECT_EQ(bench.requests(), kStepNotDone | kTravelFailed);
  EXPECT_FALSE(bench.module.is_moving());
}

TEST(Bushd1, ForbidRaisesNoRequest) {  // U16
  Bushd1Bench bench;
  bench.depart();
  bench.module.run_step_done();
  bench.forbid();
  EXPECT_EQ(bench.shutter.stops, 1);
  bench.module.limits(false, false);
  bench.module.run_ends();
  bench.module.stands();
  EXPECT_EQ(bench.requests(), 0U);
  bench.permit(0);
  bench.forbid();
  bench.module.step_done();
  EXPECT_EQ(bench.requests(), 0U);
  EXPECT_FALSE(bench.module.is_moving());
}

TEST(Bushd1, ModeAndDirectionAreLatched) {  // U17
  Bushd1Bench bench;
  bench.depart();
  bench.set_control(0x02);
  bench.run(true);
  EXPECT_EQ(bench.requests(), kLeftLimit | kLeftLevel);
  EXPECT_TRUE(bench.lam()) << "enables are not";
  EXPECT_TRUE(bench.module.is_moving());
}

TEST(Bushd1, InitialiseClearAndInhibit) {  // U18
  Bushd1Bench bench;
  bench.depart();
  bench.crate.initialise();
  EXPECT_EQ(bench.shutter.stops, 1);
  EXPECT_EQ(bench.requests(), kRightLevel);
  EXPECT_EQ(bench.control(), 0U);
  EXPECT_EQ(bench.address(), 0U);
  EXPECT_EQ(bench.read().data, 4U);
  bench.module.stands();
  bench.set_address(255);
  bench.write(0);
  bench.crate.clear();
  EXPECT_EQ(bench.requests(), kRightLevel);
  bench.crate.set_inhibit(true);
  bench.permit();
  EXPECT_TRUE(bench.shutter.steps.empty());
}

}  // namespace
}  // namespace bushd::camac::bushd1_test
