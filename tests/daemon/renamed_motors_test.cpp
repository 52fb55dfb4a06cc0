// A position belongs to an output of an MCU: what a motor finds whose name, output or scale in
// bushd.toml was another one for a while.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/kept_lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

std::string with(std::string toml, const std::string& from, const std::string& to) {
  const std::size_t at = toml.find(from);
  if (at == std::string::npos) throw std::invalid_argument(from);
  return toml.replace(at, from.size(), to);
}

struct RenamedLab : KeptLab {
  RenamedLab() : RenamedLab(hall(1, 2)) {}
  explicit RenamedLab(const std::string& text) : KeptLab(text), toml(text) {
    reach("m01", 300);
    reach("m02", -70);
    run_for(0.2);
  }
  void use(const std::string& text) {
    use_configuration(text);
    reconnect();
  }
  void expect_uncertain(const std::string& name, const std::string& why) {
    EXPECT_EQ(motor(name).trust, api::Trust::kUncertain);
    EXPECT_EQ(motor(name).position_steps, shaft_steps(name)) << "what people may confirm";
    expect_refused(name, why);
  }
  void confirm(const std::string& name) {
    EXPECT_EQ(ask(api::Confirm{{name}}).result, "done");
    run_for(0.2);
  }
  std::string toml;
};

constexpr const char* kM01 = "name = \"m01\"";
constexpr const char* kOther = "name = \"other\"";

TEST(RenamedMotors, HaveThePositionOfTheirOutputAndPeopleSayWhetherItIsTheirs) {
  for (const bool power_cut : {false, true}) {
    RenamedLab lab;
    lab.use(with(lab.toml, kM01, kOther));
    if (power_cut) lab.cut_all_power();
    lab.expect_uncertain("other",
                         "output 0 of MCU hall:1 was motor \"m01\" before; last known: 300");
    lab.expect_at_shaft("m02", power_cut ? api::Trust::kRestored : api::Trust::kKnown);
    lab.confirm("other");
    lab.reach("other", 10);
    lab.run_for(0.2);
    lab.cut_all_power();
    lab.expect_at_shaft("other", api::Trust::kRestored);
  }
}

TEST(RenamedMotors, FindWhatMovedMeanwhileWhenTheirNameComesBack) {
  for (unsigned cuts = 0; cuts < 8; ++cuts) {
    SCOPED_TRACE(cuts);
    RenamedLab lab;
    lab.use(with(lab.toml, kM01, kOther));
    if ((cuts & 1) != 0) lab.cut_all_power();
    lab.confirm("other");
    lab.reach("other", 240);
    lab.run_for(0.2);
    if ((cuts & 2) != 0) lab.cut_all_power();
    lab.use(lab.toml);
    if ((cuts & 4) != 0) lab.cut_all_power();
    EXPECT_EQ(lab.shaft_steps("m01"), 540);
    lab.expect_uncertain("m01", "");
    // It stays so until somebody says where it stands.
    lab.go_on_with_next_daemon();
    lab.expect_uncertain("m01", "");
    lab.confirm("m01");
    lab.go_on_with_next_daemon();
    lab.expect_at_shaft("m01", api::Trust::kKnown);
  }
}

// `set` leaves the shaft where it is: the counter alone would look as good as before.
TEST(RenamedMotors, DoNotBelieveACounterThatAnotherNameHasSet) {
  RenamedLab lab;
  lab.use(with(lab.toml, kM01, kOther));
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"other"}, {0}).result, "done");
  lab.run_for(0.2);
  lab.use(lab.toml);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("m01").position_steps, 0);
}

// The daemon is killed as soon as the other name may move: the disk knows whose the output is.
TEST(RenamedMotors, AreKnownToTheDiskBeforeTheyMove) {
  RenamedLab lab;
  const std::string renamed = with(lab.toml, kM01, kOther);
  lab.use_configuration(renamed);
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 20));
  lab.disk_us = 200'000;
  const auto number = lab.send(Ask::kSetPosition, {"other"}, {0});
  ASSERT_TRUE(lab.run_until([&] { return lab.has_result(number); }, 5));
  EXPECT_EQ(lab.last_reply(number).result, "done");
  lab.disk_us = 500;
  lab.use(lab.toml);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST(RenamedMotors, ThatChangePlacesAreUncertainThereAndBack) {
  RenamedLab lab;
  std::string swapped = with(lab.toml, kM01, "name = \"m00\"");
  swapped = with(swapped, "name = \"m02\"", kM01);
  swapped = with(swapped, "name = \"m00\"", "name = \"m02\"");
  lab.use(swapped);
  lab.expect_uncertain("m01", "was motor \"m02\" before; last known: -70 steps");
  lab.expect_uncertain("m02", "was motor \"m01\" before; last known: 300 steps");
  lab.confirm("m01");
  lab.reach("m01", 10);
  lab.run_for(0.2);
  lab.cut_all_power();
  lab.expect_at_shaft("m01", api::Trust::kRestored);
  lab.use(lab.toml);
  lab.expect_uncertain("m01", "");
  lab.expect_uncertain("m02", "");
}

TEST(RenamedMotors, AreAsGoodAsBeforeWhenTheNameIsTakenBackBeforeTheyHaveMoved) {
  for (unsigned cuts = 0; cuts < 4; ++cuts) {
    SCOPED_TRACE(cuts);
    RenamedLab lab;
    lab.use(with(lab.toml, kM01, kOther));
    if ((cuts & 1) != 0) lab.cut_all_power();
    lab.expect_uncertain("other", "");
    lab.use(lab.toml);
    if ((cuts & 2) != 0) lab.cut_all_power();
    lab.expect_at_shaft("m01", cuts == 0 ? api::Trust::kKnown : api::Trust::kRestored);
  }
}

// Nobody has said where it stands: a name makes that no worse.
TEST(RenamedMotors, OfWhichNothingIsKnownMayMoveAsBefore) {
  Lab lab(hall(1, 1));
  lab.keep_positions();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
  lab.run_for(0.2);
  lab.use_configuration(with(hall(1, 1), kM01, kOther));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"other"}, {100}).result, "reached");
  EXPECT_EQ(lab.motor("other").position_steps, 200);
}

std::string scaled(const std::string& steps_per_unit) {
  return with(hall(1, 2), kM01,
              std::string(kM01) + "\nunit = \"mm\"\nsteps_per_unit = " + steps_per_unit);
}

TEST(RenamedMotors, AreAsGoodAsBeforeWhenAScaleIsTakenBackBeforeTheyHaveMoved) {
  for (unsigned cuts = 0; cuts < 4; ++cuts) {
    SCOPED_TRACE(cuts);
    RenamedLab lab(scaled("100"));
    lab.use(scaled("200"));
    lab.expect_uncertain("m01", "its steps_per_unit was changed from 100 to 200");
    if ((cuts & 1) != 0) lab.cut_all_power();
    lab.go_on_with_next_daemon();
    lab.expect_uncertain("m01", "its steps_per_unit was changed from 100 to 200");
    if ((cuts & 2) != 0) lab.cut_all_power();
    lab.use(scaled("100"));
    lab.expect_at_shaft("m01", cuts == 0 ? api::Trust::kKnown : api::Trust::kRestored);
  }
}

TEST(RenamedMotors, AreUncertainWhenAScaleIsTakenBackAfterTheyHaveMoved) {
  RenamedLab lab(scaled("100"));
  lab.use(scaled("200"));
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {600}).result, "done");
  lab.reach("m01", 10);
  lab.reach("m01", -10);
  lab.run_for(0.2);
  lab.use(scaled("100"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_THAT(lab.motor("m01").uncertain_reason,
              HasSubstr("its steps_per_unit was changed from 200 to 100"));
  // Nothing that was said of the first change.
  lab.go_on_with_next_daemon();
  EXPECT_THAT(lab.motor("m01").uncertain_reason,
              HasSubstr("its steps_per_unit was changed from 200 to 100"));
}

}  // namespace
}  // namespace bushd::test
