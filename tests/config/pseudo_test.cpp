// [[pseudo]]: axes that are computed from motors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "config/config.h"
#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::kGood;
using test::replaced;
using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;

// Two more motors, beside "slit" of "roof".
const std::string kBlades =
    "[[motor]]\nname = \"left\"\nmcu = \"roof:255\"\noutput = 1\ngroup = \"slits\"\n"
    "[[motor]]\nname = \"right\"\nmcu = \"roof:255\"\noutput = 2\ngroup = \"slits\"\n";

Result<Config> load(const std::string& keys, const std::string& calibration = "") {
  const ConfigFile file(kGood + kBlades + "[[pseudo]]\n" + keys);
  std::ofstream(file.directory().path() / "energy.csv") << calibration;
  return file.load();
}

std::string pseudo_error(const std::string& keys, const std::string& calibration = "") {
  return test::error_of(load(keys, calibration));
}

const std::string kSlit =
    "name = [\"gap\", \"centre\"]\nunit = \"mm\"\nmotors = [\"left\", \"right\"]\n";

TEST(ConfigPseudo, ASlit) {
  const auto config = test::good(
      load(kSlit + "kind = \"slit\"\noffset = [0.5, 0]\nsoft_limits = [[0, 10], [-5, 5]]\n"));
  ASSERT_EQ(config.pseudos.size(), 1u);
  const Pseudo& slit = config.pseudos[0];
  EXPECT_THAT(slit.motors, ElementsAre(MotorId{2}, MotorId{3}));
  EXPECT_EQ(slit.axes[0].name, "gap");
  EXPECT_EQ(slit.axes[1].unit, "mm");
  EXPECT_EQ(slit.axes[1].soft_limits, (units::SoftLimits{-5, 5}));
  EXPECT_EQ(slit.axes[0].decimals, 4);
  const auto& law = std::get<pseudo::LinearAxes>(slit.law);
  const std::vector<double> motors{-1, 3};
  EXPECT_THAT(law.positions(motors), ElementsAre(DoubleEq(4.5), DoubleEq(1)));
}

TEST(ConfigPseudo, OneAxisNeedsNoLists) {
  const auto config = test::good(
      load("name = \"sum\"\nunit = \"mm\"\nmotors = [\"left\", \"right\"]\nmatrix = [[1, 1]]\n"
           "offset = 2\nsoft_limits = [0, 10.5]\nprecision = 2\n"));
  const Pseudo& sum = config.pseudos[0];
  EXPECT_EQ(sum.axes[0].soft_limits, (units::SoftLimits{0, 10.5}));
  EXPECT_EQ(sum.axes[0].decimals, 2);
  const std::vector<double> motors{1, 2};
  EXPECT_THAT(std::get<pseudo::LinearAxes>(sum.law).positions(motors), ElementsAre(DoubleEq(5)));
}

const std::string kEnergy =
    "name = \"energy\"\nunit = \"eV\"\nmotors = [\"left\"]\ncalibration = \"energy.csv\"\n";

TEST(ConfigPseudo, ACalibrationIsBesideTheConfiguration) {
  const auto config = test::good(load(kEnergy, "energy,left\n5000,20\n6000,15\n"));
  const auto& law = std::get<pseudo::CurvedAxis>(config.pseudos[0].law);
  EXPECT_EQ(law.range(), (pseudo::Range{5000, 6000}));
}

TEST(ConfigPseudo, WhatIsWrongInACalibrationNamesBothFiles) {
  EXPECT_THAT(pseudo_error(kEnergy, "energy,left\n5000,20\n5000,15\n"),
              testing::AllOf(HasSubstr("energy.csv:3: left over energy: 5000 does not rise"),
                             HasSubstr("(the calibration in "), HasSubstr("bushd.toml:")));
  EXPECT_THAT(pseudo_error(kEnergy, "energy,right\n1,2\n3,4\n"), HasSubstr("no column \"left\""));
  EXPECT_THAT(pseudo_error(replaced(kEnergy, "energy.csv", "none.csv")), HasSubstr("none.csv"));
  EXPECT_THAT(pseudo_error(kEnergy + "matrix = [[1]]\n", "energy,left\n1,2\n3,4\n"),
              HasSubstr("matrix: does not go with `calibration`"));
}

TEST(ConfigPseudo, WhatCannotBeIsRefused) {
  const std::string matrix = kSlit + "matrix = [[1, 0], [0, 1]]\n";
  EXPECT_EQ(pseudo_error(matrix), "no error");
  const auto with = [&](const std::string& from, const std::string& to) {
    return pseudo_error(replaced(matrix, from, to));
  };
  EXPECT_THAT(with("gap", "left"), HasSubstr("left is already taken in line"));
  EXPECT_THAT(with("gap", "Centre"), HasSubstr("centre is already taken in line"));
  EXPECT_THAT(with("gap", "-gap"), HasSubstr("is \"-gap\"; allowed: 1..63 characters"));
  EXPECT_THAT(with("[\"gap\", \"centre\"]", "[]"), HasSubstr("name: is empty; allowed: a name"));
  EXPECT_THAT(with("[\"gap\", \"centre\"]", "[\"gap\", 3]"), HasSubstr("name[1]: is 3"));
  EXPECT_THAT(with("\"mm\"", "[\"mm\", \"mm\", \"mm\"]"), HasSubstr("unit: has 3 elements"));
  EXPECT_THAT(with("\"mm\"", "\"\""), HasSubstr("unit: is not allowed"));
  EXPECT_THAT(with("\"right\"]", "\"top\"]"), HasSubstr("motors: is \"top\""));
  EXPECT_THAT(with("\"right\"]", "\"left\"]"), HasSubstr("is \"left\"; allowed: each motor once"));
  EXPECT_THAT(with("\"right\"]", "\"theta\"]"),
              HasSubstr("\"left\" and \"theta\" are on different buses"));
  EXPECT_THAT(with("[0, 1]]", "[2, 0]]"), HasSubstr("depend on each other"));
  EXPECT_THAT(with("[0, 1]]", "[0]]"), HasSubstr("matrix: allowed: 2 rows, as `name`, of 2"));
  EXPECT_THAT(with("[0, 1]]", "7]"), HasSubstr("matrix[1]: is 7"));
  EXPECT_THAT(pseudo_error(matrix + "offset = [1]\n"), HasSubstr("offset: has 1 elements"));
  EXPECT_THAT(pseudo_error(matrix + "soft_limits = [0, 1]\n"), HasSubstr("soft_limits[0]: is 0"));
  EXPECT_THAT(pseudo_error(matrix + "soft_limits = [[0, 1], [2, 2]]\n"),
              HasSubstr("soft_limits[1]"));
  EXPECT_THAT(pseudo_error(matrix + "speed = 3\n"), HasSubstr("speed"));
  EXPECT_THAT(pseudo_error(kSlit), HasSubstr("matrix: is missing"));
  EXPECT_THAT(
      pseudo_error(replaced(kSlit, "\"centre\"]", "\"centre\", \"x\"]") + "kind = \"slit\"\n"),
      HasSubstr("kind: is \"slit\", which has two axes"));
  EXPECT_THAT(pseudo_error(kSlit + "kind = \"table\"\n"), HasSubstr("allowed: \"slit\""));
  EXPECT_THAT(pseudo_error(matrix + "kind = \"slit\"\n"),
              HasSubstr("matrix: does not go with `kind`; allowed: one of the two keys"));
}

}  // namespace
}  // namespace bushd::config
