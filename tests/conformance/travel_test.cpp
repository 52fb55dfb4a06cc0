// TRAVEL by pins alone: a shutter between two limit switches, of the image and of its virtual twin.
#include <random>

#include "conformance/script.h"

namespace bushd::sim::travel_test {
namespace {

constexpr TimeNs kSlotNs = kTickNs / 128;
constexpr std::uint8_t kMotor = 3;
constexpr std::uint16_t kRight = 1 << 3;  // inputs
constexpr std::uint16_t kLeft = 1 << 4;
constexpr std::uint16_t kSensor = 1 << 5;
constexpr std::uint32_t kSteps = 12;
constexpr std::uint32_t kDelayUs = 150'000;

class Travels : public TargetScript {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kMotor}));
    bushd_set_inputs settings{};
    settings.limit_positive = settings.limit_negative = 1 << kMotor;
    ASSERT_NO_FATAL_FAILURE(ask(settings));
    ASSERT_NO_FATAL_FAILURE(ask(bushd_motor_inputs{kMotor, 3, 4, 4}));
    sense();
    pass_ticks(4);
  }
  void TearDown() override {
    expect_the_same_reports();
    Script::TearDown();
  }

  std::int64_t position(std::size_t mcu) { return Script::position(mcu, kMotor); }
  void sense() {
    for (const std::size_t mcu : {0, 1}) {
      const std::int64_t at = position(mcu);
      unsigned active = others_;
      if (at >= kSteps) active |= kRight;
      if (at <= 0) active |= kLeft;
      bus_.node(mcu).set_inputs({static_cast<std::uint16_t>(active), system_});
    }
  }
  void pass(TimeNs ns) {
    for (const TimeNs end_ns = bus_.now_ns() + ns; bus_.now_ns() < end_ns;) {
      bus_.advance_to(std::min(bus_.now_ns() + TimeNs{kTickNs} / 4, end_ns));
      sense();
    }
  }
  void turn(bool active) {
    system_ = active ? BUSHD_INPUT_TRIGGER : 0;
    sense();
  }
  // By the sums of the table's delays, from the beginning of a run on.
  void expect_run(std::size_t mcu, const std::vector<TimeNs>& made, std::size_t first,
                  TimeNs begin_ns) {
    SCOPED_TRACE(mcu == 0 ? "virtual" : "real");
    ASSERT_GE(made.size(), first + kSteps);
    TimeNs expected_ns = begin_ns;
    for (std::size_t i = 0; i < kSteps; ++i) {
      const auto code = [&](std::size_t k) { return k < codes_.size() ? codes_[k] : kCruise; };
      expected_ns += TimeNs{std::max(code(i), code(kSteps - 1 - i))} * kUnitNs;
      EXPECT_LE(std::abs(made[first + i] - expected_ns), kSlotNs + 5'000) << "step " << i;
    }
  }

  std::uint16_t others_ = 0;
  std::uint8_t system_ = 0;
};
BUSHD_FOR_TARGETS(Travels, targets());

TEST_P(Travels, EachReactorStartOpensTheShutterOnceAndInTime) {
  constexpr std::uint32_t kWaitUs = 320'000;
  std::mt19937 random(3);
  ASSERT_NO_FATAL_FAILURE(ask(bushd_travel{1, BUSHD_TRAVEL_LIMITS, kMotor, 1, BUSHD_EDGE_RISING, 0,
                                           kSteps, kDelayUs, kWaitUs}));
  for (int start = 0; start < 3; ++start) {
    SCOPED_TRACE("start " + std::to_string(start));
    pass(static_cast<TimeNs>(random() % (2 * kTickNs)));
    EXPECT_EQ(master_.poll(kReal).homing, BUSHD_TRAVEL_ARMED);
    const TimeNs edge_ns = bus_.now_ns();
    turn(true);
    pass(50'000'000);
    turn(false);
    pass(20'000'000);
    turn(true);  // comes too early to count
    pass(20'000'000);
    turn(false);
    pass(320'000'000);
    for (const std::size_t mcu : {0, 1}) {
      const auto made = steps_since(mcu, kMotor, edge_ns);
      EXPECT_EQ(made.size(), 2 * kSteps);
      expect_run(mcu, made, 0, edge_ns + TimeNs{kDelayUs} * 1000);
      expect_run(mcu, made, kSteps, edge_ns + TimeNs{kWaitUs} * 1000);
      EXPECT_EQ(position(mcu), 0);
    }
    expect_the_same_reports();
  }
  bushd_travel none{};
  none.motor = kMotor;
  ASSERT_NO_FATAL_FAILURE(ask(none));
  turn(true);
  pass(200'000'000);
  EXPECT_EQ(position(1), 0);
  EXPECT_EQ(master_.poll(kReal).homing, BUSHD_TRAVEL_STOPPED);
}

TEST_P(Travels, OneStepIsSeenOrNot) {
  const auto step = [&](std::uint8_t number) {
    ask(bushd_travel{number, BUSHD_TRAVEL_STEP, kMotor, 1, BUSHD_EDGE_NONE, 5, 1, 0, 40'000});
  };
  ASSERT_NO_FATAL_FAILURE(step(1));
  pass(20'000'000);
  EXPECT_EQ(master_.poll(kReal).homing, BUSHD_TRAVEL_STEPS);
  others_ = kSensor;
  pass(20'000'000);
  EXPECT_EQ(master_.poll(kReal).homing, BUSHD_TRAVEL_DONE);
  ASSERT_NO_FATAL_FAILURE(step(2));
  pass(80'000'000);
  EXPECT_EQ(master_.poll(kReal).homing, BUSHD_TRAVEL_NOT_SEEN);
  for (const std::size_t mcu : {0, 1}) EXPECT_EQ(position(mcu), 2);
}

}  // namespace
}  // namespace bushd::sim::travel_test
