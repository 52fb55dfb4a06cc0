// Programs that outlive power cuts of their MCUs, as the daemon has them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/program_lab.h"

namespace bushd::test {
namespace {

using testing::Contains;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kConsents = "programs_without_host = true\nprograms_at_power_on = true\n";
constexpr const char* kAtPowerOn =
    "without_host = true\nkept = true\nat_power_on = true\nrange = { m01 = [-10, 60] }\n";
constexpr const char* kThere = "[[frame]]\nmove_by = [50]\n";

struct KeptLab : ProgramLab {
  explicit KeptLab(const std::string& toml = hall_with(1, 2, kConsents)) : ProgramLab(toml, true) {}

  void cut_power() {
    bus(0).mcu(0).set_reset_cause(BUSHD_RESET_POWER_ON);
    bus(0).reboot(0, 100'000'000);
  }
  bool is_back() {
    return run_until([&] { return !all_ready(); }, 10) && run_until([&] { return all_ready(); });
  }
};

TEST(ProgramsKept, PutAnswersWhenAPowerCutWouldLeaveIt) {
  KeptLab lab;
  const std::int64_t before = lab.now_us();
  const Answer put = lab.put("a", "\"m01\"", kThere, "kept = true\n");
  ASSERT_EQ(put.result, "done") << put.reason;
  EXPECT_TRUE(put.programs.at(0).kept);
  EXPECT_TRUE(put.programs.at(0).stored);
  EXPECT_FALSE(put.programs.at(0).at_power_on);
  EXPECT_GT(lab.now_us() - before, 512 * 2560) << "as long as it has to stay the same";
  lab.cut_power();
  ASSERT_TRUE(lab.is_back());
  EXPECT_EQ(lab.entry().stage, "loaded");
  EXPECT_EQ(lab.entry().program, "a");
  EXPECT_TRUE(lab.steps.none());
  ASSERT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "done");
  EXPECT_EQ(lab.wait(lab.run({"a"})).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 50);
  ASSERT_EQ(lab.ask(api::EraseProgram{"a"}).result, "done");
  lab.cut_power();
  ASSERT_TRUE(lab.is_back());
  EXPECT_EQ(lab.entry().stage, "none");
}

// The MCU writes nothing while a motor moves, and nobody waits for ever.
TEST(ProgramsKept, PutAndEraseSayThatItIsNotKeptYet) {
  KeptLab lab;
  const std::int64_t move = lab.send(Ask::kMoveBy, {"m02"}, {2'000'000});
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m02").moving; }));
  const Answer put = lab.put("a", "\"m01\"", kThere, "kept = true\n");
  ASSERT_EQ(put.result, "done") << put.reason;
  EXPECT_FALSE(put.programs.at(0).stored);
  EXPECT_THAT(lab.ask(api::EraseProgram{"a"}),
              Ends("fault", "would have it again after a power cut"));
  EXPECT_FALSE(lab.has_result(move)) << "longer than both";
}

// Else the one before would be back after a power cut, and begin.
TEST(ProgramsKept, OneInItsPlaceAnswersWhenThatIsStored) {
  KeptLab lab;
  ASSERT_EQ(lab.put("a", "\"m01\"", kThere, kAtPowerOn).result, "done");
  const std::int64_t before = lab.now_us();
  const Answer put = lab.put("b", "\"m01\"", kThere);
  ASSERT_EQ(put.result, "done") << put.reason;
  EXPECT_FALSE(put.programs.at(0).kept);
  EXPECT_GT(lab.now_us() - before, 512 * 2560);
  lab.cut_power();
  ASSERT_TRUE(lab.is_back());
  EXPECT_EQ(lab.entry().stage, "none");
  lab.run_for(3);
  EXPECT_TRUE(lab.steps.none());
}

// The MCU has it, and may have written it.
TEST(ProgramsKept, AnMcuThatIsLostWhileItWritesIsTold) {
  KeptLab lab;
  const std::int64_t put = lab.send(ProgramLab::put_of("a", "\"m01\"", kThere, "kept = true\n"));
  ASSERT_TRUE(lab.run_until([&] { return lab.entry().stage == "loaded"; }));
  lab.run_for(0.3);
  ASSERT_FALSE(lab.has_result(put));
  lab.cut_power();
  EXPECT_THAT(lab.wait(put), Ends("link", "it is put, and may outlive a power cut or not"));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  EXPECT_EQ(lab.entry().stage, "none");
}

TEST(ProgramsKept, WhatIsBeingWrittenWaitsForNobodyElse) {
  KeptLab lab;
  const std::int64_t put = lab.send(ProgramLab::put_of("a", "\"m01\"", kThere, "kept = true\n"));
  ASSERT_TRUE(lab.run_until([&] { return lab.entry().stage == "loaded"; }));
  ASSERT_FALSE(lab.has_result(put));
  const std::string checksum = lab.entry().checksum;
  EXPECT_THAT(lab.ask(api::EraseProgram{checksum}).reason,
              HasSubstr("gets or erases a program; wait for its end"));
  EXPECT_EQ(lab.wait(put).result, "done");
  const std::int64_t erase = lab.send(api::EraseProgram{"a"});
  ASSERT_TRUE(lab.run_until([&] { return lab.entry().stage == "none"; }));
  ASSERT_FALSE(lab.has_result(erase));
  EXPECT_THAT(lab.put("b", "\"m01\"", kThere).reason, HasSubstr("erases its program"));
  EXPECT_EQ(lab.wait(erase).result, "done");
  EXPECT_EQ(lab.put("b", "\"m01\"", kThere).result, "done");
}

TEST(ProgramsKept, OneThatBeginsAtPowerOnIsFollowed) {
  KeptLab lab;
  const char* const endless =
      "[[frame]]\nrepeat = 0\n[[frame]]\nmove_by = [50]\n[[frame]]\nmove_by = [-50]\n"
      "[[frame]]\nwait_s = 0.1\n[[frame]]\nnext = true\n";
  ASSERT_EQ(lab.put("a", "\"m01\"", endless, kAtPowerOn).result, "done");
  lab.run_for(3);
  EXPECT_TRUE(lab.steps.none()) << "putting it begins nothing";
  lab.cut_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.steps.of(0, 0).size() > 200; }));
  ASSERT_TRUE(lab.run_until([&] { return !lab.warnings().empty(); }));
  EXPECT_THAT(lab.warnings(), Contains(HasSubstr("goes on; it begins whenever the power comes")));
  EXPECT_EQ(lab.entry().stage, "runs");
  EXPECT_EQ(lab.entry().program, "a");
  EXPECT_TRUE(lab.entry().at_power_on);
  EXPECT_THAT(lab.state_of("hall:1").program, StartsWith("a runs, frame "));
  EXPECT_THAT(lab.state_of("hall:1").program, EndsWith(" repeats, without host"));
  EXPECT_NE(lab.motor("m01").trust, api::Trust::kKnown) << "nobody knows where it began";
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01"}, {5}).reason, HasSubstr("a program of its"));
  EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
  EXPECT_EQ(lab.state_of("hall:1").program, "");
  EXPECT_NE(lab.motor("m01").trust, api::Trust::kKnown);
}

// As after a power cut of the whole lab: a daemon that knows no names finds it, stops it if it is
// not allowed, and erases it by its checksum.
TEST(ProgramsKept, AnotherConfigurationStopsItAndErasesIt) {
  KeptLab lab;
  const char* const endless =
      "[[frame]]\nrepeat = 0\n[[frame]]\nmove_by = [50]\n[[frame]]\nmove_by = [-50]\n"
      "[[frame]]\nnext = true\n";
  ASSERT_EQ(lab.put("a", "\"m01\"", endless, kAtPowerOn).result, "done");
  lab.use_configuration(hall_with(1, 2, "programs_without_host = true\n"));
  lab.connect();
  EXPECT_THAT(lab.warnings(),
              Contains(HasSubstr("programs_at_power_on does not allow it; erase it")));
  lab.cut_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.entry().stage == "ended"; }));
  EXPECT_THAT(lab.warnings(),
              Contains(HasSubstr("is stopped; it begins whenever the power comes")));
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
  const std::string checksum = lab.entry().checksum;
  EXPECT_EQ(lab.entry().program, "");
  EXPECT_EQ(lab.ask(api::EraseProgram{"ffffffff"}).phase, Answer::kRefused);
  ASSERT_EQ(lab.ask(api::EraseProgram{checksum}).result, "done");
  const std::size_t made = lab.steps.of(0, 0).size();
  lab.cut_power();
  ASSERT_TRUE(lab.is_back());
  lab.run_for(3);
  EXPECT_EQ(lab.steps.of(0, 0).size(), made);
}

TEST(ProgramsKept, IsRefusedWithoutConsentOrMemoryForIt) {
  KeptLab lab(hall_with(1, 2, "programs_without_host = true\n"));
  const Answer refused = lab.put("a", "\"m01\"", kThere, kAtPowerOn);
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_THAT(refused.reason, HasSubstr("set programs_at_power_on = true in its [[mcu]]"));
  ProgramLab none(hall_with(1, 2, kConsents));
  EXPECT_THAT(none.put("a", "\"m01\"", kThere, "kept = true\n"),
              Ends("fault", "keeps no program over a reset; leave kept and at_power_on out"));
}

}  // namespace
}  // namespace bushd::test
