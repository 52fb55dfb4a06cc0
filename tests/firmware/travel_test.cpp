// TRAVEL: from one limit to the other and back, exact to a slot, and steps that a sensor has to
// see.
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kTraveller = 1;
constexpr std::uint16_t kTravellerBit = 1 << kTraveller;
constexpr std::uint16_t kLeft = 1 << 2;    // the input of its negative limit
constexpr std::uint16_t kSensor = 1 << 3;  // of no motor's
constexpr std::uint32_t kWay = 60;         // steps between the limits

struct Made {
  std::int64_t slot;  // since tick 0
  int direction;
  friend bool operator==(const Made&, const Made&) = default;
};

class Travel : public Streams {
 protected:
  Travel() {
    watch({});
    rig.sense = [this] {
      const std::int64_t at = rig.pulses(kTraveller) + stands_;
      unsigned active = others_;
      if (at >= right_) active |= kTravellerBit;
      if (at <= left_) active |= kLeft;
      return bushd_inputs{static_cast<std::uint16_t>(active), 0};
    };
    rig.pass(2);
  }
  void watch(InputSettings settings) {
    settings.limit_positive = settings.limit_negative = kTravellerBit;
    ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
    ASSERT_EQ(rig.motor_inputs({kTraveller, 1, 2, 1}), BUSHD_OK);
  }
  bushd_status request(const bushd_travel& message) { return rig.request(message); }
  // From the left limit, with a delay of 20 ms before the return.
  bushd_travel once(std::uint32_t steps = kWay) {
    return {++number_, BUSHD_TRAVEL_LIMITS, kTraveller, 1, BUSHD_EDGE_NONE, 0, steps, 0, 20'000};
  }
  bushd_travel at_edges(std::uint32_t delay_us, std::uint32_t wait_us) {
    return {++number_, BUSHD_TRAVEL_LIMITS, kTraveller, 1, BUSHD_EDGE_RISING, 0, kWay, delay_us,
            wait_us};
  }
  bushd_travel step(std::uint32_t wait_us = 50'000) {
    return {++number_, BUSHD_TRAVEL_STEP, kTraveller, 1, BUSHD_EDGE_NONE, 3, 1, 0, wait_us};
  }
  static bushd_travel give_up() {
    return {0, BUSHD_TRAVEL_NONE, kTraveller, 0, BUSHD_EDGE_NONE, 0, 0, 0, 0};
  }
  int stage() { return rig.poll().homing; }
  std::int64_t now_ns() const { return rig.tick() * kTick; }

  // The tick that is being emitted, and on to the next one.
  void pass() {
    const int sign = rig.slot_buffer().steps[kTraveller] < 0 ? -1 : 1;
    for (std::int64_t slot = 0; slot < kSlots; ++slot) {
      if (rig.slot_buffer().step[slot] & kTravellerBit)
        made.push_back({rig.tick() * kSlots + slot, sign});
    }
    rig.pass();
  }
  void pass_while(std::initializer_list<int> stages) {
    const auto holds = [&] { return std::ranges::find(stages, stage()) != stages.end(); };
    for (int i = 0; i < 20'000 && holds(); ++i) pass();
    EXPECT_FALSE(holds());
  }
  void pass_until_rest() {
    for (int i = 0; i < 20'000 && rig.poll().moving != 0; ++i) pass();
    EXPECT_EQ(rig.poll().moving, 0);
  }
  // Where they belong by the sums of the table's delays, of a run that begins at this time.
  void expect_run(std::int64_t begin_ns, int direction) {
    const auto reference = Reference::move(law, kWay);
    for (std::size_t i = 0; i < kWay; ++i) {
      const auto at_ns = begin_ns + static_cast<std::int64_t>(reference.step(i).end / 256);
      expected.push_back(
          {at_ns % kTick == 0 ? at_ns / kTick * kSlots - 1 : at_ns * kSlots / kTick, direction});
    }
    end_ns = begin_ns + static_cast<std::int64_t>(reference.step(kWay - 1).end / 256);
  }
  void expect_counted() {
    EXPECT_EQ(rig.poll().motor[kTraveller].position_steps, rig.pulses(kTraveller));
    EXPECT_EQ(rig.steps_with_dir(), 0);
    EXPECT_EQ(rig.steps_while_disabled(), 0);
  }
  void expect_ends(bushd_travel_stage stage, std::int64_t at) {
    pass_until_rest();
    EXPECT_EQ(rig.poll().homing, stage);
    EXPECT_EQ(rig.pulses(kTraveller), at);
    EXPECT_EQ(rig.poll().autonomous, 0);
    expect_counted();
  }

  std::int64_t left_ = 0;
  std::int64_t right_ = kWay;
  std::int64_t stands_ = 0;
  std::uint16_t others_ = 0;
  std::uint8_t number_ = 0;
  std::vector<Made> made;
  std::vector<Made> expected;
  std::int64_t end_ns = 0;  // of the last run
};
BUSHD_IN_BOTH_FORMATS(Travel);

TEST_P(Travel, GoesThereAndBack) {
  const std::uint32_t first = rig.first_open();
  ASSERT_EQ(request(once()), BUSHD_OK);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.autonomous, kTravellerBit);
  EXPECT_EQ(report.moving, kTravellerBit);
  EXPECT_EQ(report.running, kTravellerBit);
  EXPECT_EQ(report.homing, BUSHD_TRAVEL_DELAY);
  EXPECT_EQ(report.trigger_number, number_);
  pass_while({BUSHD_TRAVEL_DELAY, BUSHD_TRAVEL_RUN});
  EXPECT_EQ(stage(), BUSHD_TRAVEL_RETURN_DELAY);
  EXPECT_EQ(rig.pulses(kTraveller), kWay);
  EXPECT_EQ(rig.poll().forbidden_positive, kTravellerBit);
  pass_while({BUSHD_TRAVEL_RETURN_DELAY});
  EXPECT_EQ(stage(), BUSHD_TRAVEL_RETURN);
  expect_ends(BUSHD_TRAVEL_DONE, 0);
  expect_run(first * kTick, 1);
  expect_run(end_ns + 20'000'000, -1);
  EXPECT_EQ(made, expected);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
}

TEST_P(Travel, FollowsEachEdge) {
  std::mt19937 random(8);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  for (int i = 0; i < 12; ++i) {
    const std::uint32_t delay_us = 150'000 + below(2000);
    // Sometimes over before the run has ended: then the return begins as soon as the limit is seen.
    const bool at_once = i % 4 == 3;
    const std::uint32_t wait_us = at_once ? 50 : 900'000 + below(2000);
    ASSERT_EQ(request(at_edges(delay_us, wait_us)), BUSHD_OK);
    for (int repetition = 0; repetition < 2; ++repetition) {
      made.clear(), expected.clear();
      rig.pass(static_cast<int>(below(5)));
      ASSERT_EQ(rig.awaited_edge(), BUSHD_EDGE_RISING);
      EXPECT_EQ(stage(), BUSHD_TRAVEL_ARMED);
      EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_ARMED);
      const auto in_tick_ns = static_cast<std::int32_t>(below(Rig::kTickNs));
      const std::int64_t edge_ns = now_ns() + in_tick_ns;
      rig.trigger(in_tick_ns);
      EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE) << "a start during a travel is ignored";
      expect_run(edge_ns + delay_us * 1000ll, 1);
      pass_while({BUSHD_TRAVEL_DELAY, BUSHD_TRAVEL_RUN});
      const bushd_report report = rig.poll();
      EXPECT_EQ(report.trigger_state, BUSHD_TRIGGER_STARTED);
      EXPECT_EQ(report.start_tick * kTick + report.start_ns, edge_ns + delay_us * 1000ll);
      // Read about in the tick after that of the last step; prepared then is the next one.
      const std::int64_t earliest_ns = ((end_ns - 1) / kTick + 3) * kTick;
      const std::int64_t return_ns = edge_ns + wait_us * 1000ll;
      ASSERT_EQ(return_ns < earliest_ns, at_once);
      expect_run(std::max(return_ns, earliest_ns), -1);
      pass_while({BUSHD_TRAVEL_RETURN_DELAY, BUSHD_TRAVEL_RETURN});
      ASSERT_EQ(made, expected);
    }
    ASSERT_EQ(request(give_up()), BUSHD_OK);
    rig.pass();
    expect_ends(BUSHD_TRAVEL_STOPPED, 0);
    EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
  }
}

TEST_P(Travel, TheFarLimitIsReachedWithTheLastStep) {
  right_ = 40;
  ASSERT_EQ(request(once()), BUSHD_OK);
  pass_until_rest();
  EXPECT_EQ(stage(), BUSHD_TRAVEL_EARLY);
  EXPECT_LT(rig.pulses(kTraveller), static_cast<std::int64_t>(kWay));
  expect_counted();
}

TEST_P(Travel, AndNotLater) {
  right_ = kWay + 1;
  ASSERT_EQ(request(once()), BUSHD_OK);
  expect_ends(BUSHD_TRAVEL_NOT_REACHED, kWay);
}

TEST_P(Travel, TheNearLimitIsLeft) {
  left_ = kWay;
  ASSERT_EQ(request(once()), BUSHD_OK);
  expect_ends(BUSHD_TRAVEL_NOT_LEFT, kWay);
}

TEST_P(Travel, ErrorsOfTheReturn) {
  ASSERT_EQ(request(once()), BUSHD_OK);
  pass_while({BUSHD_TRAVEL_DELAY, BUSHD_TRAVEL_RUN});
  left_ = -1;
  expect_ends(BUSHD_TRAVEL_NOT_REACHED, 0);
  left_ = 0;
  rig.pass(2);
  ASSERT_EQ(request(once()), BUSHD_OK);
  pass_while({BUSHD_TRAVEL_DELAY, BUSHD_TRAVEL_RUN});
  left_ = kWay;
  pass_until_rest();
  EXPECT_EQ(stage(), BUSHD_TRAVEL_EARLY) << "active where the return was to begin";
  EXPECT_EQ(rig.pulses(kTraveller), static_cast<std::int64_t>(kWay));
}

TEST_P(Travel, LimitsAreDebounced) {
  InputSettings settings;
  settings.debounce_ticks = 5;
  watch(settings);
  rig.pass(8);
  ASSERT_EQ(request(once()), BUSHD_OK);
  expect_ends(BUSHD_TRAVEL_DONE, 0);
}

// Contacts bounce for as long as `debounce_ticks` says, which is what it is for: the last reading
// of that is wrong, the others are as chance has it.
TEST_P(Travel, ArrivesAndLeavesHoweverSwitchesBounce) {
  std::mt19937 random(11);
  for (std::uint8_t debounce_ticks = 1; debounce_ticks <= BUSHD_MAX_DEBOUNCE_TICKS;
       ++debounce_ticks) {
    for (const std::uint32_t way : {1u, 2u, 5u, kWay}) {
      SCOPED_TRACE(testing::Message() << way << " steps, debounce " << int{debounce_ticks});
      struct Contact {
        bool closed = false;
        bool read = false;
        std::uint32_t changed = 0;
      };
      Contact right;
      Contact left{.closed = true, .read = true};
      std::optional<std::uint32_t> read_at;
      right_ = way;
      rig.sense = [&] {
        const std::int64_t at = rig.pulses(kTraveller) + stands_;
        const auto read = [&](Contact& contact, bool closed) {
          if (std::exchange(contact.closed, closed) != closed) contact.changed = rig.tick();
          const std::uint32_t since = rig.tick() - contact.changed;
          const bool wrong = since + 1 == debounce_ticks || random() % 2 == 0;
          contact.read = since < debounce_ticks && wrong ? !closed : closed;
        };
        if (std::exchange(read_at, rig.tick()) != rig.tick()) {
          read(right, at >= right_);
          read(left, at <= left_);
        }
        return bushd_inputs{
            static_cast<std::uint16_t>((right.read ? kTravellerBit : 0) | (left.read ? kLeft : 0)),
            0};
      };
      InputSettings settings;
      settings.debounce_ticks = debounce_ticks;
      rig.pass(40);
      ASSERT_EQ(rig.set_inputs({}), BUSHD_OK);  // the travel of before is forgotten
      watch(settings);
      rig.pass(40);
      ASSERT_EQ(request(once(way)), BUSHD_OK);
      expect_ends(BUSHD_TRAVEL_DONE, 0);
      if (HasFailure()) return;
    }
  }
}

TEST_P(Travel, EndsByFaultsAndByStops) {
  const auto in_flight = [&] {
    ASSERT_EQ(request(once()), BUSHD_OK);
    for (int i = 0; i < 20; ++i) pass();
    ASSERT_EQ(stage(), BUSHD_TRAVEL_RUN);
  };
  in_flight();
  ASSERT_EQ(request(give_up()), BUSHD_OK);
  pass_until_rest();
  EXPECT_EQ(stage(), BUSHD_TRAVEL_STOPPED);
  EXPECT_EQ(rig.poll().faults, 0);
  expect_counted();
  stands_ = -rig.pulses(kTraveller);
  rig.pass(2);
  in_flight();
  rig.emergency(BUSHD_STOP_RAMP);
  pass_until_rest();
  EXPECT_EQ(stage(), BUSHD_TRAVEL_STOPPED);
  expect_counted();
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  stands_ = -rig.pulses(kTraveller);
  rig.pass(2);
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 12), BUSHD_OK);
  ASSERT_EQ(request(at_edges(200'000, 900'000)), BUSHD_OK);
  for (int i = 0; i < 20; ++i) Travel::rig.pass();
  EXPECT_EQ(stage(), BUSHD_TRAVEL_STOPPED) << "silence: a shutter does not go on by itself";
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(rig.awaited_edge(), BUSHD_EDGE_NONE);
}

// Nothing of it has been prepared: there is no step to complete.
TEST_P(Travel, StoppedBeforeItsStepItMakesNone) {
  ASSERT_EQ(request(step()), BUSHD_OK);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass();
  expect_ends(BUSHD_TRAVEL_STOPPED, 0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  ASSERT_EQ(request(step()), BUSHD_OK);
  ASSERT_EQ(request(give_up()), BUSHD_OK);
  rig.pass();
  expect_ends(BUSHD_TRAVEL_STOPPED, 0);
  // The limit becomes active between the request and the first tick.
  ASSERT_EQ(request(step()), BUSHD_OK);
  right_ = stands_;
  rig.pass();
  expect_ends(BUSHD_TRAVEL_STOPPED, 0);
}

TEST_P(Travel, ASensorSeesTheStep) {
  ASSERT_EQ(request(step()), BUSHD_OK);
  EXPECT_EQ(stage(), BUSHD_TRAVEL_STEPS);
  for (int i = 0; i < 100 && rig.pulses(kTraveller) == 0; ++i) rig.pass();
  rig.pass(5);
  EXPECT_EQ(stage(), BUSHD_TRAVEL_STEPS);
  others_ = kSensor;
  rig.pass();
  expect_ends(BUSHD_TRAVEL_DONE, 1);
  // It must be inactive before.
  ASSERT_EQ(request(step()), BUSHD_OK);
  const std::uint32_t begun = rig.tick();
  expect_ends(BUSHD_TRAVEL_NOT_SEEN, 2);
  const std::int64_t took_ns = (rig.tick() - begun) * kTick;
  const std::int64_t step_ns = static_cast<std::int64_t>(Reference::move(law, 1).step(0).end / 256);
  EXPECT_GE(took_ns, step_ns + 50'000'000);
  EXPECT_LE(took_ns, step_ns + 50'000'000 + 5 * kTick);
}

TEST_P(Travel, TheSameNumberAgainIsTheSameFrame) {
  others_ = 0;
  const bushd_travel message = step();
  ASSERT_EQ(request(message), BUSHD_OK);
  ASSERT_EQ(request(message), BUSHD_OK);
  expect_ends(BUSHD_TRAVEL_NOT_SEEN, 1);
  ASSERT_EQ(request(message), BUSHD_OK) << "its acknowledgement was lost";
  rig.pass(20);
  EXPECT_EQ(rig.pulses(kTraveller), 1) << "no second step";
}

TEST_P(Travel, Refusals) {
  bushd_travel bad = once();
  bad.motor = 0;
  EXPECT_EQ(request(bad), BUSHD_E_FORMAT) << "it has no limits";
  bad.motor = 4;
  EXPECT_EQ(request(bad), BUSHD_E_FORMAT);
  bad = once();
  bad.direction = -1;
  EXPECT_EQ(request(bad), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(request(at_edges(10'000, 50)), BUSHD_E_FORMAT) << "less than four ticks";
  bad = step();
  bad.sensor = 4;
  EXPECT_EQ(request(bad), BUSHD_E_FORMAT);
  ASSERT_EQ(rig.motor_inputs({kTraveller, 1, 1, 1}), BUSHD_OK);
  EXPECT_EQ(request(once()), BUSHD_E_FORMAT) << "one switch for both ends";
  ASSERT_EQ(rig.motor_inputs({kTraveller, 1, 2, 1}), BUSHD_OK);
  ASSERT_EQ(request(at_edges(150'000, 900'000)), BUSHD_OK);
  EXPECT_EQ(request(once()), BUSHD_E_STATE);
  EXPECT_EQ(rig.home({0, 1, 100, 0, 10, 1000, 0}), BUSHD_E_STATE);
  EXPECT_EQ(rig.arm(99, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 5, 0}}), BUSHD_E_STATE);
  EXPECT_EQ(rig.set_position(kTraveller, 5), BUSHD_E_STATE);
  EXPECT_EQ(rig.poll().trigger_state, BUSHD_TRIGGER_ARMED);
  ASSERT_EQ(request(give_up()), BUSHD_OK);
  rig.pass(3);
  ASSERT_EQ(request(give_up()), BUSHD_OK) << "no error";
  ASSERT_EQ(rig.arm(99, BUSHD_EDGE_RISING, 50, {{0, 0, 1, 5, 0}}), BUSHD_OK);
  EXPECT_EQ(request(once()), BUSHD_E_STATE);
  ASSERT_EQ(rig.disarm(), BUSHD_OK);
  ASSERT_EQ(rig.home({0, 1, 100, 0, 10, 1000, 0}), BUSHD_OK);
  EXPECT_EQ(request(once()), BUSHD_E_STATE);
}

TEST(TravelOfASmallMcu, IsUnknown) {
  ReadyRig rig(ramp_law(), BUSHD_FORMAT_FINE, {.disabled_capabilities = BUSHD_CAN_TRAVEL});
  EXPECT_EQ(rig.identify().capabilities & BUSHD_CAN_TRAVEL, 0);
  const bushd_travel message = {1, BUSHD_TRAVEL_STEP, 0, 1, BUSHD_EDGE_NONE, 0, 1, 0, 50};
  EXPECT_EQ(rig.request(message), BUSHD_E_UNKNOWN_MESSAGE);
}

TEST_P(Travel, IsRefusedWhereItsStepsAreNotCounted) {
  ASSERT_EQ(rig.set_position(kTraveller, INT32_MAX - 30), BUSHD_OK);
  EXPECT_EQ(request(once(31)), BUSHD_E_FORMAT);
  ASSERT_EQ(request(once(30)), BUSHD_OK);
}

}  // namespace
}  // namespace bushd::test
