// When the queue ends while a motor moves: it ramps down by its own table from wherever it is,
// loses no count, and says so until told that it was heard.
#include <algorithm>
#include <numeric>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

class RampDown : public Streams {
 protected:
  // The steps of every tick after the cut, from the formula.
  std::vector<int> expected_after(const Plan& moves, std::size_t cut) const {
    const bool fine = format == BUSHD_FORMAT_FINE;
    std::vector<int> steps =
        steps_by_tick(Reference::ramp_down(law, moves.delay[cut - 1],
                                           fine ? moves.fraction[cut - 1] : std::uint8_t{0}),
                      Rig::kTickNs);
    for (int& n : steps) n *= moves.direction;
    return steps;
  }
  // Sends the first `cut` ticks of a plan and lets the queue end there; returns the steps of each
  // tick from the first one of the plan on.
  static std::vector<int> cut_off(Rig& on, const Plan& moves, std::size_t cut, std::uint8_t motor) {
    const std::uint32_t start = on.first_open();
    on.forget_history();
    for (std::size_t from = 0; from < cut; from += 20) {
      EXPECT_EQ(on.take(on.part(moves, start, from, std::min<std::size_t>(20, cut - from), motor)),
                BUSHD_OK);
      while (start + static_cast<std::uint32_t>(from) - on.tick() > 3) on.pass();
    }
    on.pass_until_rest();
    on.pass(3);
    return {on.history(motor).begin() + 2, on.history(motor).end()};
  }
};
BUSHD_IN_BOTH_FORMATS(RampDown);

TEST_P(RampDown, FollowsTheTableFromEveryTickOfALongMove) {
  for (const std::int64_t steps : {260, -260}) {
    const Plan moves = plan(steps);
    ASSERT_GT(moves.ticks(), 120u);
    for (std::size_t cut = 1; cut < moves.ticks(); ++cut) {
      ReadyRig fresh(law, format, {}, 5);
      std::vector<int> seen = cut_off(fresh, moves, cut, 1);
      ASSERT_EQ(fresh.poll().faults, BUSHD_FAULT_LINK) << "cut " << cut;
      ASSERT_EQ(fresh.poll().state, BUSHD_STATE_FAULT);
      ASSERT_EQ(fresh.poll().motor[1].position_steps, fresh.pulses(1));
      const std::int64_t made = std::accumulate(
          seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(cut), std::int64_t{0});
      ASSERT_EQ(made, moves.direction * moves.made[cut - 1]);
      seen.erase(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(cut));
      // A motor of which no displacement was heard yet rests: it need not begin in order to stop.
      const bool begun = std::any_of(moves.displacement.begin(),
                                     moves.displacement.begin() + static_cast<std::ptrdiff_t>(cut),
                                     [](std::int16_t d) { return d != 0 && d != 0x80; });
      std::vector<int> expected = begun ? expected_after(moves, cut) : std::vector<int>{};
      expected.resize(seen.size());
      ASSERT_EQ(seen, expected) << "cut " << cut;
    }
  }
}

TEST_P(RampDown, CompleteMoveIsNoFault) {
  const Plan moves = plan(30);
  cut_off(rig, moves, moves.ticks(), 0);
  EXPECT_EQ(rig.poll().faults, 0);
  EXPECT_EQ(rig.pulses(0), 30);
}

TEST_P(RampDown, FaultIsLatchedRefusesTicksAndIsClearedAtRestOnly) {
  const Plan moves = plan(200);
  ASSERT_EQ(rig.take(rig.part(moves, rig.first_open(), 0, 40)), BUSHD_OK);
  rig.pass(45);
  ASSERT_EQ(rig.poll().state, BUSHD_STATE_FAULT);
  ASSERT_EQ(rig.poll().moving, 1);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_E_STATE);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 2, 0)), BUSHD_E_STATE);
  Ticks other = ones(kStart, rig.first_open(), 2, 0);
  other.mask = 2;
  EXPECT_EQ(rig.take(other), BUSHD_E_STATE);
  EXPECT_TRUE(rig.enabled());
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_FAULT) << "latched";
  EXPECT_EQ(rig.take(ones(kStart, rig.first_open(), 2, 0)), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(rig.poll().state, BUSHD_STATE_READY);
  // And from there it goes on, with its count.
  const std::int64_t position = rig.pulses(0);
  rig.run_plan(plan(-position), 0);
  EXPECT_EQ(rig.poll().motor[0].position_steps, 0);
  EXPECT_EQ(rig.pulses(0), 0);
}

TEST_P(RampDown, OthersFinishWhatIsQueued) {
  const Plan cut = plan(200);
  const Plan whole = plan(-60);
  const std::uint32_t start = rig.first_open();
  ASSERT_EQ(rig.take(rig.part(whole, start, 0, 50, 3)), BUSHD_OK);
  ASSERT_EQ(rig.take(rig.part(whole, start, 50, 80, 3)), BUSHD_OK);
  ASSERT_EQ(rig.take(rig.part(cut, start, 0, 30, 0)), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.pulses(3), -60);
  EXPECT_EQ(rig.poll().motor[3].position_steps, -60);
  const auto down = Reference::ramp_down(
      law, cut.delay[29], format == BUSHD_FORMAT_FINE ? cut.fraction[29] : std::uint8_t{0});
  EXPECT_EQ(rig.pulses(0), cut.made[29] + static_cast<std::int64_t>(down.steps()));
}

// Each motor by itself, all at once, each with another table and cut in another place.
TEST_P(RampDown, SixteenMotorsByFourTables) {
  ReadyRig all(law, format, {.motors = 16, .slots = 128, .code_count = 1000}, 0xFFFFFFD0u);
  std::vector<Law> laws(4, law);
  for (std::uint8_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < laws[i].decel.size(); ++k) {
      laws[i].decel[k] = static_cast<std::uint16_t>(190 + 15 * i - k * (4u + i * 4u));
    }
    ASSERT_EQ(all.upload(i, laws[i]), BUSHD_OK);
  }
  std::vector<Plan> plans;
  const std::uint32_t start = all.first_open();
  for (std::uint8_t m = 0; m < 16; ++m) {
    ASSERT_EQ(all.assign(m, m % 4), BUSHD_OK);
    plans.push_back(plan_move(laws[m % 4], m % 2 ? 300 : -300, Rig::kTickNs, format));
    const std::size_t cut = 25 + 5u * m;
    for (std::size_t from = 0; from < cut; from += 25) {
      ASSERT_EQ(all.take(all.part(plans[m], start, from, std::min<std::size_t>(25, cut - from), m)),
                BUSHD_OK);
    }
  }
  all.pass_until_rest();
  const bushd_report report = all.poll();
  for (std::uint8_t m = 0; m < 16; ++m) {
    const std::size_t last = 24 + 5u * m;
    const auto down = Reference::ramp_down(
        laws[m % 4], plans[m].delay[last],
        format == BUSHD_FORMAT_FINE ? plans[m].fraction[last] : std::uint8_t{0});
    EXPECT_EQ(all.pulses(m),
              plans[m].direction * (plans[m].made[last] + static_cast<std::int64_t>(down.steps())))
        << int{m};
    EXPECT_EQ(report.motor[m].position_steps, all.pulses(m));
  }
}

// The start was heard, but the queue ended before its first displacement: which way the move was to
// go is not known, and the motor stands. DIR still shows the move before.
TEST_P(RampDown, MotorThatHasNotBegunStays) {
  rig.run_plan(plan(-20), 0);
  const std::int16_t nothing = format == BUSHD_FORMAT_FINE ? 0 : 0x80;
  ASSERT_EQ(rig.take({.flags = kStart,
                      .first = rig.first_open(),
                      .count = 2,
                      .displacements = {nothing, nothing},
                      .delays = {60000}}),
            BUSHD_OK);
  rig.pass(3000);
  EXPECT_EQ(rig.poll().moving, 0);
  EXPECT_EQ(rig.poll().faults, BUSHD_FAULT_LINK) << "still, a move was not made";
  EXPECT_EQ(rig.pulses(0), -20);
  EXPECT_EQ(rig.poll().motor[0].position_steps, -20);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  rig.run_plan(plan(20), 0);
  EXPECT_EQ(rig.pulses(0), 0);
}

// A pause within a move, slower than the tick, is no rest.
TEST_P(RampDown, SlowMoveRampsDownFromATickWithoutAStep) {
  Law slow = law;
  slow.accel = slow.decel = {3000, 2500, 2000};
  slow.cruise = 2000;
  ReadyRig fresh(slow, format, {}, 5);
  const Plan moves = plan_move(slow, -20, Rig::kTickNs, format);
  const std::vector<int> seen = cut_off(fresh, moves, 110, 0);
  ASSERT_EQ(moves.made[109], 2);
  EXPECT_EQ(fresh.pulses(0), -2 - 1 - 2) << "two made, the running one, D(1) and D(0)";
  EXPECT_EQ(fresh.poll().motor[0].position_steps, -5);
}

// A delay below the cruise delay cannot be running; it must not let the MCU use codes that no move
// reaches and no check of the table's speed has seen.
TEST_P(RampDown, DelayThatNoMoveHasIsTakenAsCruise) {
  Law steep = law;
  steep.decel.assign(200, 2);
  steep.decel[0] = 100;
  steep.cruise = 60;
  for (const std::uint16_t delay : std::initializer_list<std::uint16_t>{1, 2, 59, 60}) {
    ReadyRig fresh(steep, format, {.slots = 128}, 5);
    fresh.forget_history();
    ASSERT_EQ(fresh.take({.flags = kStart,
                          .first = fresh.first_open(),
                          .displacements = {one()},
                          .delays = {delay}}),
              BUSHD_OK);
    fresh.pass_until_rest();
    EXPECT_EQ(fresh.pulses(0), 1 + 1 + 1) << "the one sent, the running one, D(0)";
    EXPECT_EQ(fresh.poll().motor[0].position_steps, 3);
  }
}

}  // namespace
}  // namespace bushd::test
