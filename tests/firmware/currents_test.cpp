// CURRENTS: which current a motor's windings have, as the port is told it.
#include "firmware/rig.h"
#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr bushd_currents kSet{0, BUSHD_DECAY_FAST, 1500, 1000, 300};

class Currents : public Streams {
 protected:
  void SetUp() override {
    bushd_emission emission{};
    emission.mode = BUSHD_EMISSION_PHASES;
    ASSERT_EQ(rig.emission(emission), BUSHD_OK);
    ASSERT_EQ(rig.assign(0, 0), BUSHD_OK);
  }
  std::vector<std::uint16_t> told() const {
    std::vector<std::uint16_t> ma;
    for (const Rig::Winding& winding : rig.windings()) ma.push_back(winding.ma);
    return ma;
  }
};
BUSHD_IN_BOTH_FORMATS(Currents);

TEST_P(Currents, AStreamHasThatOfRampsThenOfCruiseThenOfHold) {
  ASSERT_EQ(rig.currents(kSet), BUSHD_OK);
  rig.pass(BUSHD_CURRENT_TICKS + 3);
  const Plan plan = plan_move(law, 3000, Rig::kTickNs, GetParam());
  rig.run_plan(plan, 0);
  rig.pass_until_rest();
  rig.pass(BUSHD_CURRENT_TICKS + 3);
  EXPECT_EQ(told(), (std::vector<std::uint16_t>{300, 1500, 1000, 1500, 300}));
  for (const Rig::Winding& winding : rig.windings()) EXPECT_TRUE(winding.fast_decay);
}

TEST_P(Currents, ATableRunHasThemInTheTicksOfItsSpeeds) {
  ASSERT_EQ(rig.currents(kSet), BUSHD_OK);
  rig.pass(BUSHD_CURRENT_TICKS + 3);
  const std::uint32_t first = rig.first_open() + 3;
  const bushd_table_run_entry entry{0, 0, 1, 3000, 0};
  ASSERT_EQ(rig.take(BUSHD_MSG_TABLE_RUN, table_run_payload(0, first, entry)), BUSHD_OK);
  std::map<std::uint16_t, std::uint32_t> since;  // tick that was prepared when it was told
  std::size_t seen = rig.windings().size();
  for (int i = 0; i < 30'000 && since.size() < 4; ++i) {
    rig.pass();
    if (rig.windings().size() == seen) continue;
    ++seen;
    since.emplace(rig.windings().back().ma, rig.tick() + 1);
    if (since.contains(1000)) break;
  }
  EXPECT_LE(since.at(1500), first) << "it is there when the run begins";
  EXPECT_GE(since.at(1500) + 4, first) << "and was not before the run was taken";
  // The delay of cruise is reached when all steps of the accelerating side are made.
  const auto reference = Reference::move(law, 3000, 0);
  const auto reached_ticks =
      static_cast<std::uint32_t>(reference.step(law.accel.size()).end / 256 / Rig::kTickNs);
  EXPECT_GE(since.at(1000), first + reached_ticks + BUSHD_CURRENT_TICKS - 2);
  EXPECT_LE(since.at(1000), first + reached_ticks + BUSHD_CURRENT_TICKS + 2);
  rig.pass_until_rest();
  rig.pass(BUSHD_CURRENT_TICKS + 3);
  EXPECT_EQ(told(), (std::vector<std::uint16_t>{300, 1500, 1000, 1500, 300}));
}

TEST_P(Currents, AreNotControlledWithoutPhasesOrSettings) {
  rig.pass(20);
  EXPECT_TRUE(rig.windings().empty());
  ASSERT_EQ(rig.currents(kSet), BUSHD_OK);
  rig.pass(20);
  ASSERT_EQ(rig.emission({}), BUSHD_OK);
  rig.pass(2);
  EXPECT_EQ(told().back(), 0);
}

TEST_P(Currents, AreKeptOverAReset) {
  ASSERT_EQ(rig.currents(kSet), BUSHD_OK);
  rig.restart_with_nvm();
  EXPECT_EQ(rig.mcu().config.currents[0].settings.cruise_ma, 1000);
}

TEST(CurrentsOfAPort, ThatControlsNoneAreRefused) {
  Rig none({.disabled_capabilities = BUSHD_CAN_CURRENTS});
  EXPECT_EQ(none.identify().capabilities & BUSHD_CAN_CURRENTS, 0);
  EXPECT_EQ(none.currents(kSet), BUSHD_E_UNKNOWN_MESSAGE);
  Rig one;
  EXPECT_EQ(one.currents({1, BUSHD_DECAY_SLOW, 1, 1, 1}), BUSHD_E_FORMAT);
}

}  // namespace
}  // namespace bushd::test
