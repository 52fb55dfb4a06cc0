// The whole way from a command to a shaft: the daemon's core, the line, the firmware core, its
// slots and ticks, and a motor with inertia behind the pins. It is the table's motor with all that
// the table asks for, so it would lose steps if the way made steps much rougher than the table has
// them.
#include <gtest/gtest.h>

#include "lab.h"
#include "sim/plant.h"
#include "sim/shipped_motors.h"

namespace bushd::test {
namespace {

struct Way {
  std::string table;
  std::string manner;
};

class OnTheBus : public testing::TestWithParam<Way> {};

TEST_P(OnTheBus, ShippedTablesMoveTheirMotorsWithoutLosingSteps) {
  const auto& [name, manner] = GetParam();
  const auto table = tables::load(kShippedTables / (name + ".toml")).value();
  const auto motor = shipped_motor(name);
  const auto rotor = rotor_rules(motor, motor.friction_nm, 0.1);
  sim::Plant plant(1);
  Lab lab(hall(1, 1, manner, name), {}, &plant);
  const sim::PaceRules pace(table->view(), 2'560'000, 256,
                            manner.starts_with("coarse") ? BUSHD_FORMAT_COARSE : BUSHD_FORMAT_FINE);
  plant.attach(0, 0, pace);
  plant.couple(0, 0, rotor);
  plant.on_violation = [](sim::TimeNs, std::size_t, std::size_t, const std::string& what) {
    ADD_FAILURE() << what;
  };
  lab.connect();
  std::int64_t to = 0;
  const std::int64_t both = table->view().accel.count + table->view().decel.count;
  for (const std::int64_t steps : {both / 4, -both / 2, both + 500}) {
    to += steps;
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {steps}).result, "reached");
  }
  lab.run_for(0.2);
  EXPECT_EQ(plant.position_steps(0, 0), to);
  EXPECT_EQ(plant.rotor(0, 0).lost_full_steps(), 0);
  EXPECT_NEAR(static_cast<double>(plant.rotor(0, 0).position_full_steps()),
              static_cast<double>(to) * motor.full_steps_per_turn / motor.steps_per_turn, 1);
}

std::vector<Way> ways() {
  std::vector<Way> all;
  for (const char* table : {"nema17-torque", "nema23-stage", "bushd2-constant"}) {
    for (const char* manner : {"fine_ticks", "coarse_ticks", "fine_table"}) {
      all.push_back({table, manner});
    }
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(, OnTheBus, testing::ValuesIn(ways()), [](const auto& test) {
  std::string text = test.param.table + "_" + test.param.manner;
  std::replace(text.begin(), text.end(), '-', '_');
  return text;
});

}  // namespace
}  // namespace bushd::test
