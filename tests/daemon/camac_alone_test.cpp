// BUSHD-1 and BUSHD-2 without the computer, and by any law of codes: loaded by NAF, begun by F26,
// and judged by the edges of the motors. Where those belong is computed from the bytes in the
// modules' memories, by the sums of the report, and by nothing that the daemon has made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/camac_lab.h"
#include "daemon/program_lab.h"

namespace bushd::test::camac_alone_test {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr std::uint32_t kEnabled = 0x60;  // fault and end of motion
constexpr std::uint32_t kLeft = 0x80;
constexpr std::uint32_t kAutomatic = 0x40;
constexpr std::uint32_t kSynchronous = 0x80;
constexpr std::uint32_t kAllOfShutter = 0x37;
constexpr std::int64_t kCodeNs = 40'000;  // 1 s / (250 x 100 Hz)
constexpr std::int64_t kSlotNs = 2'560'000 / 128;
constexpr double kNear = static_cast<double>(kSlotNs);

// Both modules go on without the computer.
std::string alone(std::string toml) {
  const auto behind = [&](const std::string& text, const std::string& key) {
    toml.insert(toml.find(text) + text.size(), key);
  };
  behind("[[mcu]]\n", "programs_without_host = true\n");
  behind("type = \"bushd-2\"\n", "without_computer = true\n");
  behind("type = \"bushd-1\"\n", "without_computer = true\n");
  return toml;
}

std::vector<int> falling() {
  std::vector<int> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(std::max(250 - i * 2, 10));
  return codes;
}
std::vector<int> any_codes(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int> codes;
  for (int i = 0; i < 238; ++i) codes.push_back(25 + static_cast<int>(random() % 200));
  return codes;
}

// The report: step k of N, from 0, comes after code min(k, N - 1 - k, 237).
std::vector<std::int64_t> due_ns(const std::vector<int>& codes, int steps) {
  std::vector<std::int64_t> due;
  std::int64_t at = 0;
  for (int k = 0; k < steps; ++k) {
    at += std::max(codes[static_cast<std::size_t>(std::min({k, steps - 1 - k, 237}))], 1) * kCodeNs;
    due.push_back(at);
  }
  return due;
}

void expect_steps(const std::vector<sim::TimeNs>& made, const std::vector<std::int64_t>& due) {
  ASSERT_EQ(made.size(), due.size());
  for (std::size_t i = 0; i < due.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(made[i] - made[0]), static_cast<double>(due[i] - due[0]), kNear)
        << "step " << i;
  }
}

struct Edges {
  StepTimes edges;
};
class AloneLab : private Edges, public CamacLab {
 public:
  explicit AloneLab(const std::string& toml = alone(lab_with()), std::uint32_t disabled = 0)
      : CamacLab(toml, &edges, kStation, disabled) {}
  const std::vector<sim::TimeNs>& steps(unsigned output) { return edges.of(0, output); }
  bool begins() {
    return run_until([&] { return steps(0).size() >= 3; });
  }
  void begin(int steps_to_make, std::uint32_t control) {
    load(0, steps_to_make, falling());
    permit(control);
    if (!begins()) throw std::runtime_error("it does not begin");
  }
};

struct KeptAloneLab : AloneLab {
  KeptAloneLab() {
    keep_positions();
    connect();
  }
};

TEST(CamacAlone, Bushd2EndsWhereTheReportPutsItWithoutTheComputer) {
  for (const int steps : {475, 1001}) {
    SCOPED_TRACE(steps);
    AloneLab lab;
    lab.begin(steps, kEnabled | kLeft);
    lab.restart_daemon([&] { lab.pass_without_daemon(40); });
    expect_steps(lab.steps(0), due_ns(falling(), steps));
    EXPECT_EQ(lab.shaft_steps("m01"), -steps);
  }
}

TEST(CamacAlone, ADaemonThatLivesTellsAsEver) {
  AloneLab lab;
  lab.load(0, 300, falling());
  lab.permit(kEnabled);
  EXPECT_TRUE(lab.run_until([&] { return lab.requests() >> 8 != 0; })) << "statuses are counted";
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m01"), 300);
  EXPECT_EQ(lab.requests(), 0x10U | (300U % 4) << 8);
  expect_steps(lab.steps(0), due_ns(falling(), 300));
  lab.naf(kStation, 0, 10);
  lab.run_to_lam(kEnabled | kLeft | 1);
  EXPECT_EQ(lab.shaft_steps("m02"), -300);
  EXPECT_TRUE(lab.warnings().empty());
}

// An MCU has one program, of a name of its own.
TEST(CamacAlone, MotorsOfOneModuleMayBeAtSeveralMcus) {
  AloneLab lab(hall_of_programs(2, 1, true) +
               "[[crate]]\nnumber = 1\n"
               "[[crate.module]]\nstation = 5\ntype = \"bushd-2\"\nf_start_hz = 100\n"
               "without_computer = true\nmotors = [\"m01\", \"m02\"]\n");
  lab.load(0, 300, falling());
  for (const std::uint32_t motor : {0U, 1U, 0U}) {
    lab.run_to_lam(kEnabled | motor);
    EXPECT_EQ(lab.requests() & 0xFF, 0x10U);
    lab.naf(kStation, 0, 10);
  }
  EXPECT_EQ(lab.shaft_steps("m01"), 600);
  EXPECT_EQ(lab.shaft_steps("m02"), 300);
}

TEST(CamacAlone, F24AndStopsEndIt) {
  AloneLab lab;
  lab.begin(20'000, kEnabled);
  lab.naf(kStation, 0, 24);
  ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
  EXPECT_FALSE(lab.lam()) << "F24 raises no request";
  lab.permit(kEnabled);
  lab.naf(kStation, 0, 24);  // while the program is put
  lab.run_for(3);
  const std::size_t made = lab.steps(0).size();
  lab.run_for(3);
  EXPECT_EQ(lab.steps(0).size(), made);
  lab.naf(kStation, 0, 10);
  lab.permit(kEnabled);
  ASSERT_TRUE(lab.run_until([&] { return lab.steps(0).size() > made + 10; }));
  lab.ask(Ask::kStop, {"m01"});
  ASSERT_TRUE(lab.run_until([&] { return lab.lam(); })) << "by somebody else it is a fault";
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

TEST(CamacAlone, TheNextDaemonTellsWhatBecomesOfTheMotion) {
  for (const double away_s : {0.5, 40.0}) {
    SCOPED_TRACE(away_s);
    KeptAloneLab lab;
    lab.begin(1001, kEnabled | kLeft);
    lab.run_for(0.2);
    lab.restart_daemon([&] { lab.pass_without_daemon(away_s); });
    EXPECT_EQ(lab.naf(kStation, 2, 0).data, kEnabled | kLeft) << "the control register";
    EXPECT_FALSE(lab.lam());
    lab.naf(kStation, 0, 26);
    ASSERT_TRUE(lab.wait_for_lam(120));
    EXPECT_EQ(lab.requests(), 0x10U | (1001U % 4) << 8);
    expect_steps(lab.steps(0), due_ns(falling(), 1001));
    EXPECT_EQ(lab.motor("m01").position_steps, -1001);
    lab.naf(kStation, 0, 10);
    lab.naf(kStation, 1, 16, 240);
    const unsigned low = lab.naf(kStation, 0, 0).data;
    EXPECT_EQ(low | lab.naf(kStation, 0, 0).data << 8, 0x10000U - 1001) << "U28";
    ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }));
    lab.run_to_lam(kEnabled);
    EXPECT_EQ(lab.shaft_steps("m01"), 0) << "it is the module's again";
    lab.run_for(0.2);
    lab.restart_daemon();
    lab.connect();
    EXPECT_EQ(lab.naf(kStation, 2, 0).data, 0u) << "registers begin anew";
  }
}

TEST(CamacAlone, F24OfTheNextDaemonEndsIt) {
  KeptAloneLab lab;
  lab.begin(20'000, kEnabled);
  lab.run_for(0.2);
  lab.restart_daemon();
  lab.naf(kStation, 0, 24);
  lab.run_for(5);
  const std::size_t made = lab.steps(0).size();
  EXPECT_LT(made, 10'000u);
  lab.run_for(3);
  EXPECT_EQ(lab.steps(0).size(), made);
  EXPECT_FALSE(lab.lam());
}

TEST(CamacAlone, AMotionWhoseMcuWasResetIsAFault) {
  KeptAloneLab lab;
  lab.begin(20'000, kEnabled);
  lab.run_for(0.2);
  lab.restart_daemon([&] { lab.bus(0).reboot(0, 50'000'000); });
  lab.naf(kStation, 2, 16, kEnabled);
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_NE(lab.requests() & 0xC, 0u) << "not connected, or its drivers are not enabled yet";
  EXPECT_THAT(lab.warnings(), Contains(HasSubstr("does not have the program of its motion")));
}

TEST(CamacAlone, ADaemonThatEndsLeavesTheMotionToTheNextOne) {
  KeptAloneLab lab;
  lab.begin(1001, kEnabled);
  lab.run_for(0.2);
  lab.core().shut_down(lab.now_us());
  ASSERT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }));
  lab.run_for(0.1);
  lab.restart_daemon();
  ASSERT_TRUE(lab.wait_for_lam(120));
  EXPECT_EQ(lab.requests(), 0x10U | (1001U % 4) << 8);
  EXPECT_EQ(lab.shaft_steps("m01"), 1001);
}

TEST(CamacAlone, AnMcuWithoutProgramsIsAFaultThatTheLogExplains) {
  AloneLab lab(alone(lab_with()), BUSHD_CAN_PROGRAM);
  lab.load(0, 300, falling());
  lab.permit(kEnabled);
  EXPECT_TRUE(lab.lam());
  EXPECT_THAT(lab.warnings().back(), HasSubstr("m01: the module says without_computer = true, and "
                                               "MCU hall:1 cannot have programs"));
}

TEST(CamacAnyLaw, EveryStepComesAfterItsOwnCode) {
  for (const int steps : {3, 17, 475, 476, 477, 900}) {
    SCOPED_TRACE(steps);
    AloneLab lab(lab_with());
    std::vector<int> codes = any_codes(static_cast<unsigned>(steps));
    codes[0] = 30;
    codes[1] = 90;
    lab.load(0, steps, codes);
    lab.run_to_lam(kEnabled);
    EXPECT_EQ(lab.requests(), 0x10U | static_cast<unsigned>(steps % 4) << 8);
    expect_steps(lab.steps(0), due_ns(codes, steps));
    EXPECT_THAT(lab.warnings(), Contains(HasSubstr("made as they are written; a stop in them ramps "
                                                   "down by table bushd2-constant")));
  }
}

TEST(CamacAnyLaw, TheAnswerToF26SaysWhatAStopGoesBy) {
  AloneLab lab(lab_with());
  lab.load(0, 100, any_codes(1));
  lab.naf(kStation, 2, 16, kEnabled);
  EXPECT_THAT(lab.block({.cycles = {{kStation, 0, 26, 0}}}),
              Ends("done", "m01: its codes rise and fall"));
}

TEST(CamacAnyLaw, WithoutTheComputerToo) {
  AloneLab lab;
  const std::vector<int> codes = any_codes(7);
  lab.load(0, 600, codes);
  lab.permit(kEnabled);
  ASSERT_TRUE(lab.begins());
  lab.restart_daemon([&] { lab.pass_without_daemon(20); });
  expect_steps(lab.steps(0), due_ns(codes, 600));
}

// From the delay that runs when it is asked for, by the table that bushd.toml gives the motor.
TEST(CamacAnyLaw, AStopRampsDownByTheMotorsOwnTable) {
  for (const bool estop : {false, true}) {
    AloneLab lab(lab_with());
    std::vector<int> codes(238, 10);  // at 2500 steps/s
    for (std::size_t i = 0; i < codes.size(); i += 7) codes[i] = 25;
    for (std::size_t i = 0; i < 40; ++i) codes[i] = 200 - static_cast<int>(i) * 4;
    lab.load(0, 20'000, codes);
    lab.permit(kEnabled);
    ASSERT_TRUE(lab.run_until([&] { return lab.steps(0).size() > 2000; }));
    const std::size_t before = lab.steps(0).size();
    lab.ask(estop ? Ask::kEmergencyStop : Ask::kStop, {"m01"});
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m01").moving; }));
    // bushd2-constant needs 238 steps from its greatest speed.
    const std::size_t more = lab.steps(0).size() - before;
    EXPECT_GT(more, 200u);
    EXPECT_LT(more, 300u);
    const auto& made = lab.steps(0);
    for (std::size_t i = made.size() - 200; i + 1 < made.size(); ++i) {
      EXPECT_LE(made[i] - made[i - 1], made[i + 1] - made[i] + 2 * kSlotNs) << i;
    }
    EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  }
}

TEST(CamacAnyLaw, NeedsAnMcuWithPrograms) {
  AloneLab lab(lab_with(), BUSHD_CAN_PROGRAM);
  lab.load(0, 100, any_codes(1));
  lab.permit(kEnabled);
  EXPECT_TRUE(lab.lam());
  EXPECT_THAT(lab.warnings().back(), HasSubstr("m01: its codes rise and fall, and MCU hall:1 "
                                               "cannot have programs"));
}

TEST(CamacAnyLaw, WaitsUntilItsMcuTakesCodes) {
  AloneLab lab(lab_with());
  const std::int64_t move = lab.send(Ask::kMoveBy, {"m02"}, {2000});
  lab.load(0, 100, any_codes(1));
  lab.permit(kEnabled);
  lab.run_for(0.5);
  EXPECT_TRUE(lab.steps(0).empty());
  EXPECT_EQ(lab.wait(move).result, "reached");
  ASSERT_TRUE(lab.wait_for_lam());
  EXPECT_EQ(lab.shaft_steps("m01"), 100);
}

// BUSHD-1.

const std::vector<int> kRiseAndFall{400, 250, 300, 60, 120, 50, 70, 50, 300};
const std::vector<int> kShutterCodes{400, 250, 120, 60, 50, 50, 70, 150, 300};

class AloneShutter : public MechanicsLab {
 public:
  explicit AloneShutter(bool without_computer = true) : MechanicsLab(toml(without_computer)) {}
  static std::string toml(bool without_computer) {
    const std::string plain =
        lab_with("fine", "", "inputs = { positive = 3, negative = 4, step = 5 }\n");
    return without_computer ? alone(plain) : plain;
  }
  // The run of these steps, which begins then.
  sim::TimeNs expect_run(std::size_t first, sim::TimeNs at_ns, const std::vector<int>& codes) {
    for (std::size_t i = 0; i < codes.size(); ++i) {
      at_ns += codes[i] * 50'000;
      if (first + i >= shutter().steps.size()) {
        ADD_FAILURE() << "no step " << first + i;
        break;
      }
      EXPECT_NEAR(static_cast<double>(shutter().steps[first + i].time_ns),
                  static_cast<double>(at_ns), kNear)
          << "step " << first + i;
    }
    return at_ns;
  }
};

TEST(CamacAlone, Bushd1TravelsThereAndBackWithoutTheComputer) {
  for (const std::vector<int>& codes : {kShutterCodes, kRiseAndFall}) {
    AloneShutter lab;
    lab.load_codes(codes, 6000);
    lab.permit(kAutomatic | kAllOfShutter);
    ASSERT_TRUE(lab.run_until([&] { return lab.shutter().steps.size() == 2; }));
    lab.restart_daemon([&] { lab.pass_without_daemon(2); });
    ASSERT_EQ(lab.shutter().steps.size(), 18u);
    EXPECT_EQ(lab.shutter().position, 0);
    const sim::TimeNs begin_ns = lab.shutter().steps[0].time_ns - codes[0] * 50'000;
    const sim::TimeNs there_ns = lab.expect_run(0, begin_ns, codes);
    lab.expect_run(9, there_ns + 6000 * 50'000, codes);
  }
}

TEST(CamacAlone, Bushd1FollowsReactorStartsWithoutTheComputer) {
  AloneShutter lab;
  lab.load_codes(kShutterCodes, 12'000);
  lab.permit(kAutomatic | kSynchronous | kAllOfShutter);
  lab.run_for(1);
  EXPECT_TRUE(lab.shutter().steps.empty()) << "it waits for the reactor";
  std::vector<sim::TimeNs> starts_ns;
  const auto reactor = [&] {
    starts_ns.push_back(lab.bus(0).now_ns());
    lab.shutter().reactor(true);
    lab.pass_without_daemon(0.001);
    lab.shutter().reactor(false);
    lab.pass_without_daemon(2.0003);
  };
  lab.restart_daemon([&] {
    lab.pass_without_daemon(3);
    reactor();
    reactor();
  });
  ASSERT_EQ(lab.shutter().steps.size(), 36u);
  for (std::size_t i = 0; i < 2; ++i) {
    lab.expect_run(i * 18, starts_ns[i] + 150'000'000, kShutterCodes);
    lab.expect_run(i * 18 + 9, starts_ns[i] + 600'000'000, kShutterCodes);
  }
}

TEST(CamacAlone, TheNextDaemonTellsWhatBecomesOfATravel) {
  for (const bool synchronous : {false, true}) {
    SCOPED_TRACE(synchronous);
    AloneShutter lab;
    lab.keep_positions();
    lab.connect();
    lab.load_codes(kShutterCodes, 12'000);
    const std::uint32_t mode = kAutomatic | (synchronous ? kSynchronous : 0);
    lab.permit(mode | kAllOfShutter);
    if (synchronous) {
      lab.run_for(0.5);
    } else {
      ASSERT_TRUE(lab.run_until([&] { return lab.shutter().steps.size() == 9; }));
    }
    lab.restart_daemon();
    lab.run_for(0.1);
    EXPECT_EQ(lab.naf(kShutterStation, 2, 0).data, mode | kAllOfShutter);
    if (synchronous) {
      lab.run_for(1);
      lab.shutter().reactor(true);
      lab.run_for(0.01);
      lab.shutter().reactor(false);
    }
    ASSERT_TRUE(lab.run_until([&] { return (lab.requests() & 2) != 0; })) << "left limit";
    EXPECT_EQ(lab.requests() & 0x38, 0u) << "no fault";
    EXPECT_EQ(lab.shutter().steps.size(), 18u);
    EXPECT_EQ(lab.motor("m03").moving, synchronous);
    lab.naf(kShutterStation, 0, 24);
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
    EXPECT_EQ(lab.requests() & 0x38, 0u) << "F24 raises no request";
    EXPECT_EQ(lab.motor("m03").position_steps, 0);
  }
}

TEST(CamacAlone, Bushd1TellsAsEverWhileTheDaemonLives) {
  for (const bool without_computer : {true, false}) {
    AloneShutter lab(without_computer);
    const std::vector<int>& codes = without_computer ? kShutterCodes : kRiseAndFall;
    lab.load_codes(codes, 6000);
    lab.run_to_lam(kAutomatic | kAllOfShutter);
    EXPECT_EQ(lab.requests(), 0x41u) << "right limit";
    lab.naf(kShutterStation, 0, 10);
    ASSERT_TRUE(lab.wait_for_lam());
    EXPECT_EQ(lab.requests(), 0x82u) << "left limit";
    ASSERT_TRUE(lab.run_until([&] { return !lab.motor("m03").moving; }));
    EXPECT_EQ(lab.motor("m03").position_steps, 0);
    const sim::TimeNs begin_ns = lab.shutter().steps[0].time_ns - codes[0] * 50'000;
    lab.expect_run(9, lab.expect_run(0, begin_ns, codes) + 6000 * 50'000, codes);
    EXPECT_EQ(lab.warnings().empty(), without_computer);
    lab.shutter().right_limit = 5;
    lab.naf(kShutterStation, 0, 10);
    lab.naf(kShutterStation, 0, 26);
    ASSERT_TRUE(lab.wait_for_lam());
    ASSERT_TRUE(lab.run_until([&] { return (lab.requests() & 0x10) != 0; })) << "met too early";
  }
}

}  // namespace
}  // namespace bushd::test::camac_alone_test
