// What `bushctl config` understands, shows and writes.
#include "tools/bushctl/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <string>

#include "config/config.h"
#include "config/config_file.h"
#include "results.h"
#include "tables/temp_directory.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::test::ConfigFile;
using bushd::test::good;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(Settings, OfTheCommandLine) {
  EXPECT_TRUE(parse_settings({})->motors.empty());
  EXPECT_THAT(parse_settings({"theta"})->motors, ElementsAre("theta"));
  const auto change = parse_settings({"theta", "offset=1", "soft_limits=[-5, 3]"});
  EXPECT_EQ(change->kind, api::Configure::Kind::kChange);
  EXPECT_EQ(change->changes, (std::vector<api::Configure::Change>{
                                 {"theta", "offset", "1"}, {"theta", "soft_limits", "[-5, 3]"}}));
  EXPECT_THAT(parse_settings({"offset=1"}).error().message, HasSubstr("config NAME KEY=VALUE"));
  EXPECT_THAT(parse_settings({"theta", "offset"}).error().message, HasSubstr("KEY=VALUE"));
  EXPECT_FALSE(parse_settings({"theta", "=1"}));
}

api::Configuration some() {
  return {.path = "/b.toml",
          .sha256 = "",
          .settings = {{"a", "offset", "2.5", "0"},
                       {"a", "direction", "negative", "negative"},
                       {"a", "soft_limits", "[-1, 2]", "none"}}};
}

TEST(Settings, AreShown) {
  EXPECT_THAT(table(differences(some())),
              ElementsAre("MOTOR  KEY          NOW      IN bushd.toml",  //
                          "a      offset       2.5      0",              //
                          "a      soft_limits  [-1, 2]  none"));
  EXPECT_EQ(json(some()),
            R"({"path":"/b.toml","sha256":"","settings":[)"
            R"({"motor":"a","key":"offset","value":2.5,"value_in_file":0},)"
            R"({"motor":"a","key":"direction","value":"negative","value_in_file":"negative"},)"
            R"({"motor":"a","key":"soft_limits","value":[-1,2],"value_in_file":null}]})");
}

struct Saving : testing::Test {
  std::string text() const {
    std::ifstream in(file.path());
    return {std::istreambuf_iterator<char>(in), {}};
  }
  api::Configuration wanted() const {
    const auto config = file.load();
    return {
        .path = config->absolute_path,
        .sha256 = config->text_sha256,
        .settings = {{"slit", "offset", "2.5", "0"}, {"theta", "soft_limits", "[-1, 2]", "none"}}};
  }
  ConfigFile file{bushd::test::kGood + "unit = \"mm\" # thick\nsteps_per_unit = 400\n"};
};

TEST_F(Saving, WritesWhatIsWantedAndNothingElse) {
  ASSERT_EQ(chmod(file.path().c_str(), 0640), 0);
  const auto saved = good(save(wanted()));
  EXPECT_EQ(saved.kind, api::Configure::Kind::kSaved);
  EXPECT_EQ(saved.changes, (std::vector<api::Configure::Change>{
                               {"slit", "offset", "2.5"}, {"theta", "soft_limits", "[-1, 2]"}}));
  EXPECT_THAT(text(), HasSubstr("unit = \"mm\" # thick\nsteps_per_unit = 400\noffset = 2.5\n"));
  const auto now = good(file.load());
  EXPECT_EQ(now.text_sha256, saved.file_sha256);
  EXPECT_EQ(now.motors[0].soft_limits, (bushd::units::SoftLimits{-1, 2}));
  struct stat status{};
  ASSERT_EQ(stat(file.path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST_F(Saving, IsRefusedIfTheFileIsAnother) {
  const api::Configuration before = wanted();
  std::ofstream(file.path(), std::ios::app) << "# edited\n";
  const std::string edited = text();
  EXPECT_THAT(save(before).error().text(), HasSubstr("is not as bushd has read it"));
  EXPECT_EQ(text(), edited);
  api::Configuration elsewhere = before;
  elsewhere.path = "/nonexistent/bushd.toml";
  EXPECT_THAT(save(elsewhere).error().text(), HasSubstr("save it on the PC of bushd"));
}

}  // namespace
}  // namespace bushctl
