// Lines whose motors are at serial ports of their own. What both lines of bytes were is judged by
// the levels of virtual drives, the law of lines (docs/decisions/0036-lines.md) and the skew that
// the daemon says it had.
#include <algorithm>
#include <cmath>

#include "daemon/pulse_ports.h"

namespace bushd::test {
namespace {

std::string ports(int count, const std::string& more_of_motor = {},
                  const std::string& more_of_bus = {}) {
  std::string toml = pulse_group();
  for (int i = 0; i < count; ++i) {
    const std::string name(1, static_cast<char>('a' + i));
    toml += pulse_port("com" + name, i, name, more_of_motor, i == 0 ? "" : more_of_bus);
  }
  return toml;
}

struct Table : PulseLab {
  explicit Table(int count = 2, const std::string& toml = {})
      : PulseLab(toml.empty() ? ports(count) : toml) {}

  std::int64_t line(const std::vector<std::string>& motors,
                    const std::vector<std::int64_t>& steps) {
    return send(
        api::MoveLine{.kind = api::Move::Kind::kRelative, .motors = motor_steps(motors, steps)});
  }
  // What the result says that the ports were apart.
  static double skew_ms(const Answer& answer) {
    const std::string before = "the ports were at most ";
    const std::size_t at = answer.reason.find(before);
    EXPECT_NE(at, std::string::npos) << answer.reason;
    return at == std::string::npos ? 0 : std::stod(answer.reason.substr(at + before.size()));
  }

  // Where the longest motor makes its step s, another one makes its step j at
  // s(j) = (j - 1/2) L / N + 1/2. When that is made, the longest has made s(j) steps, up to a whole
  // one that it is in, and what it makes in `skew_ms`. 0.05 ms: the figure is rounded. 2 ms: the
  // pace is told what has left once in that time.
  void expect_line(const std::vector<std::int64_t>& longest, std::int64_t of,
                   const std::vector<std::int64_t>& other, std::int64_t other_of,
                   double skew_ms) const {
    const double most = 1 + (skew_ms + 0.05 + 2) * 1e-3 * kPulseFastestHz;
    double worst = 0;
    for (std::size_t j = 1; j <= other.size(); ++j) {
      const double s =
          (static_cast<double>(j) - 0.5) * static_cast<double>(of) / static_cast<double>(other_of) +
          0.5;
      const auto made = std::ranges::upper_bound(longest, other[j - 1]) - longest.begin();
      const double off = std::abs(s - static_cast<double>(made));
      worst = std::max(worst, off);
      ASSERT_LE(off, most) << "step " << j << " of " << other_of;
    }
    std::printf("  %zu and %zu steps: at most %.1f steps of the longest off, told %.1f ms\n",
                longest.size(), other.size(), worst, skew_ms);
  }
};

// What is to be so whatever ends a line: the count, the tables, and the line itself, as far as it
// was made.
struct Whole : Table {
  using Table::Table;
  void expect_line_of(const std::vector<std::int64_t>& steps, double skew_ms) {
    EXPECT_LE(skew_ms, 28.5) << "the bound of docs/heritage.md";
    std::size_t longest = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (std::abs(steps[i]) > std::abs(steps[longest])) longest = i;
    }
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string name(1, static_cast<char>('a' + i));
      EXPECT_EQ(drive(i).faults(), 0u);
      EXPECT_EQ(motor(name).position_steps, drive(i).position_steps());
      expect_table(times(i));
      if (i == longest) continue;
      expect_line(times(longest), std::abs(steps[longest]), times(i), std::abs(steps[i]), skew_ms);
    }
  }
  // All stand on one point of the line: where the longest has made s steps, another one has made
  // floor(r (s - 1/2) + 1/2).
  void expect_on_line(const std::vector<std::int64_t>& steps) {
    const std::int64_t longest =
        std::abs(*std::ranges::max_element(steps, {}, [](std::int64_t n) { return std::abs(n); }));
    const auto at = std::ranges::find(steps, longest, [](std::int64_t n) { return std::abs(n); });
    const std::int64_t s =
        std::abs(drive(static_cast<std::size_t>(at - steps.begin())).position_steps());
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::int64_t n = std::abs(steps[i]);
      const std::int64_t made = s == 0 ? 0 : (n * (2 * s - 1) + longest) / (2 * longest);
      EXPECT_EQ(std::abs(drive(i).position_steps()), made) << i;
    }
  }
};

TEST(SerialLines, TwoPortsMakeALine) {
  Table lab;
  lab.connect();
  for (const std::int64_t other : {1000, -999, 517, -300, 100, 7, 1, 0}) {
    const std::size_t a = lab.drive(0).steps();
    const std::size_t b = lab.drive(1).steps();
    const std::int64_t from = lab.drive(1).position_steps();
    const Answer answer = lab.wait(lab.line({"a", "b"}, {1000, other}));
    ASSERT_EQ(answer.result, "reached") << answer.reason;
    std::printf("  %s; %.3f s\n", answer.reason.c_str(),
                1e-9 * static_cast<double>(lab.times(0, a).back() - lab.times(0, a).front()));
    EXPECT_EQ(lab.drive(0).faults() + lab.drive(1).faults(), 0u);
    EXPECT_EQ(lab.drive(1).position_steps() - from, other);
    EXPECT_EQ(lab.motor("b").position_steps, lab.drive(1).position_steps());
    ASSERT_EQ(lab.times(0, a).size(), 1000u);
    lab.expect_table(lab.times(0, a));
    lab.expect_table(lab.times(1, b));
    lab.expect_line(lab.times(0, a), 1000, lab.times(1, b), std::abs(other),
                    Table::skew_ms(answer));
  }
}

TEST(SerialLines, ThreePortsOfDriversThatCanLess) {
  for (const bool any : {true, false}) {
    for (const bool empty : {true, false}) {
      Whole lab(3);
      lab.set_driver(any, empty);
      lab.connect();
      const std::vector<std::int64_t> steps = {-211, 800, 533};
      const Answer answer = lab.wait(lab.line({"a", "b", "c"}, steps));
      EXPECT_EQ(answer.result, "reached") << answer.reason;
      lab.expect_line_of(steps, Table::skew_ms(answer));
      lab.expect_on_line(steps);
    }
  }
}

TEST(SerialLines, StopEndsItOnTheLine) {
  for (const double after_s : {0.0, 0.004, 0.02, 0.1, 0.3, 0.6}) {
    Whole lab;
    lab.connect();
    const std::vector<std::int64_t> steps = {3000, -1301};
    const auto line = lab.line({"a", "b"}, steps);
    lab.run_for(after_s);
    const std::uint64_t before = lab.drive(0).steps();
    EXPECT_EQ(lab.ask(Ask::kStop, {"b"}).result, "done");
    const Answer answer = lab.last_reply(line);
    EXPECT_EQ(answer.result, "stopped") << answer.reason;
    lab.expect_line_of(steps, Table::skew_ms(answer));
    lab.expect_on_line(steps);
    // 20 ms under way at each, what they are apart, up to the tick after that, and the ramp.
    EXPECT_LE(lab.drive(0).steps() - before, 50u + 50u + 8u + 61u);
  }
}

TEST(SerialLines, PauseSpeedAndAnotherEnd) {
  Whole lab;
  lab.connect();
  const std::vector<std::int64_t> steps = {4000, 2999};
  const auto first = lab.line({"a", "b"}, steps);
  lab.run_for(0.5);
  lab.ask(api::Pause{{"a"}});
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("a").velocity_steps_per_s, 0);
  lab.expect_on_line(steps);
  lab.ask(api::Resume{{"a"}});
  lab.run_for(0.4);
  // a at 3000: b where the line leads then.
  const std::int64_t b = (2999 * (2 * 3000 - 1) + 4000) / (2 * 4000);
  const Answer answer = lab.ask(api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                                              .motors = motor_steps({"a", "b"}, {3000, b}),
                                              .speed = api::Speed{.per_s = 700, .in_steps = true}});
  EXPECT_EQ(answer.result, "reached") << answer.reason;
  EXPECT_EQ(lab.last_reply(first).result, "stopped");
  EXPECT_EQ(lab.drive(0).position_steps(), 3000);
  EXPECT_EQ(lab.drive(1).position_steps(), b);
  EXPECT_EQ(lab.motor("b").position_steps, b);
  lab.expect_line(lab.times(0), 4000, lab.times(1), 2999, Table::skew_ms(answer));
  // As slow as asked at last, within what whole rates are off.
  const auto times = lab.times(0);
  EXPECT_GE(times[2700] - times[2600], 100 * std::int64_t{1'000'000'000} / 700);
}

TEST(SerialLines, LimitAtOnePortRampsTheOthersDown) {
  for (const bool longest : {true, false}) {
    Whole lab;
    lab.connect();
    lab.drive(longest ? 0 : 1).attach_switch(1, {.at_steps = 600, .positive_end = true});
    const std::vector<std::int64_t> steps = {4000, 2000};
    const Answer answer = lab.wait(lab.line({"a", "b"}, steps));
    EXPECT_EQ(answer.motor_results[longest ? 0 : 1], "limit");
    EXPECT_EQ(answer.motor_results[longest ? 1 : 0], "stopped");
    EXPECT_NE(answer.reason.find("switch at the positive end"), std::string::npos) << answer.reason;
    EXPECT_NE(answer.reason.find("which was left at"), std::string::npos) << answer.reason;
    EXPECT_NE(answer.reason.find("steps off it"), std::string::npos) << answer.reason;
    lab.expect_table(lab.times(0));
    lab.expect_table(lab.times(1));
    EXPECT_LT(lab.drive(0).steps(), 1800u);
    for (const char* const name : {"a", "b"}) {
      EXPECT_EQ(lab.motor(name).trust, api::Trust::kKnown) << name;
      EXPECT_EQ(lab.motor(name).position_steps, lab.shaft_steps(name)) << name;
    }
  }
}

TEST(SerialLines, LossOfOnePortRampsTheOthersDown) {
  Whole lab;
  lab.connect();
  const auto line = lab.line({"a", "b"}, {4000, 2000});
  lab.run_for(0.7);
  lab.unplug(1);
  const Answer answer = lab.wait(line);
  EXPECT_EQ(answer.result, "link") << answer.reason;
  EXPECT_EQ(answer.motor_results, (std::vector<std::string>{"stopped", "link"}));
  EXPECT_NE(answer.reason.find("which was left at"), std::string::npos) << answer.reason;
  lab.expect_table(lab.times(0));
  EXPECT_EQ(lab.motor("a").position_steps, lab.drive(0).position_steps());
  EXPECT_EQ(lab.motor("a").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("b").trust, api::Trust::kStale);
}

// Also before all are ready, so that nobody waits for it.
TEST(SerialLines, LossOfOnePortBeforeItBegins) {
  for (const double after_s : {0.0, 0.002, 0.005, 0.008, 0.012}) {
    Whole lab;
    lab.connect();
    const auto line = lab.line({"a", "b"}, {-4000, 2000});
    lab.run_for(after_s);
    lab.unplug(0);
    lab.wait(line);
    EXPECT_EQ(lab.motor("b").position_steps, lab.drive(1).position_steps());
    EXPECT_LE(lab.drive(1).steps(), 20u);
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"b"}, {10}).result, "reached");
  }
}

// The one that goes on waits as soon as the other one's driver has told: it is ahead by what it had
// under way, and that is told.
TEST(SerialLines, AStalledDriverHoldsTheOtherOneBack) {
  for (const std::size_t stalled : {0u, 1u}) {
    Whole lab;
    lab.connect();
    const std::vector<std::int64_t> steps = {4000, 2345};
    const auto line = lab.line({"a", "b"}, steps);
    lab.run_for(0.9);
    lab.stall_pulses(true, stalled);
    lab.run_for(0.5);
    const std::string detail = lab.state_of(stalled == 0 ? "comb" : "coma").detail;
    EXPECT_NE(detail.find("ms ahead of the slowest port; ports were at most"), std::string::npos)
        << detail;
    EXPECT_GT(lab.mcu_health(stalled == 0 ? "comb" : "coma").clock_offset_us, 10'000);
    lab.stall_pulses(false, stalled);
    const Answer answer = lab.wait(line);
    EXPECT_EQ(answer.result, "reached") << answer.reason;
    lab.expect_line_of(steps, Table::skew_ms(answer));
    // 20 ms under way, tolerances of the pace, 2 ms until it is asked, and what the other one
    // became late in those 20 ms by its rates: at cruise nothing, in the ramps before up to 6 ms.
    EXPECT_LE(Table::skew_ms(answer), 20 + 1.5 + 2 + 6);
    EXPECT_GE(Table::skew_ms(answer), 10);
  }
}

// There, back, and again from the side of the last approach: three runs of one line.
TEST(SerialLines, LastApproachesForBacklash) {
  Whole lab(2, ports(2, "backlash = 20\nbacklash_speed = 300\n"));
  lab.connect();
  EXPECT_THAT(lab.wait(lab.line({"a", "b"}, {-500, -200})), Ends("reached"));
  EXPECT_EQ(lab.drive(0).position_steps(), -500);
  EXPECT_EQ(lab.drive(1).position_steps(), -200);
  EXPECT_EQ(lab.drive(0).steps(), 540u);
  EXPECT_EQ(lab.drive(1).steps(), 240u);
  EXPECT_EQ(lab.motor("b").position_steps, -200);
}

TEST(SerialLines, EmergencyStopRampsAllDown) {
  Whole lab;
  lab.connect();
  const auto line = lab.line({"a", "b"}, {4000, -3000});
  lab.run_for(0.8);
  lab.ask(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.wait(line).result, "stopped");
  for (const std::size_t i : {0u, 1u}) {
    lab.expect_table(lab.times(i));
    EXPECT_EQ(lab.motor(i == 0 ? "a" : "b").position_steps, lab.drive(i).position_steps());
    EXPECT_EQ(lab.motor(i == 0 ? "a" : "b").trust, api::Trust::kKnown);
  }
}

TEST(SerialLines, DryRunMovesNothing) {
  Whole lab;
  lab.connect();
  const Answer answer = lab.ask(api::MoveLine{.kind = api::Move::Kind::kRelative,
                                              .motors = motor_steps({"a", "b"}, {1000, 300}),
                                              .dry_run = true});
  ASSERT_TRUE(answer.plan) << answer.reason;
  EXPECT_EQ(answer.plan->motors.size(), 2u);
  EXPECT_EQ(answer.plan->motors[1].steps, 300);
  EXPECT_GT(answer.plan->duration_us, 500'000);
  EXPECT_EQ(lab.drive(0).steps() + lab.drive(1).steps(), 0u);
}

TEST(SerialLines, RefusesWhatCannotBe) {
  const std::string hall_too =
      ports(2) +
      "[[bus]]\nname = \"hall\"\nport = \"/dev/null\"\nbaud = 500000\ntick_us = 2560\n"
      "format = \"fine\"\n[[mcu]]\nbus = \"hall\"\naddress = 1\n"
      "[[motor]]\nname = \"m\"\nmcu = \"hall:1\"\noutput = 0\ngroup = \"axes\"\n";
  Table mixed(2, hall_too);
  mixed.connect();
  const auto refused = [](Lab& lab, const api::Request& request, const std::string& why) {
    const Answer answer = lab.ask(request);
    EXPECT_EQ(answer.result, "refused") << answer.reason;
    EXPECT_NE(answer.reason.find(why), std::string::npos) << answer.reason;
  };
  const auto line = [](const std::vector<std::string>& motors) {
    return api::MoveLine{.kind = api::Move::Kind::kRelative, .motors = motor_steps(motors, {5, 3})};
  };
  refused(mixed, line({"a", "m"}), "their steps have no common time. Move them without --line");
  refused(mixed, line({"m", "b"}), "their steps have no common time");
  refused(mixed,
          api::ArmLine{.delay_us = 100,
                       .kind = api::Move::Kind::kRelative,
                       .motors = motor_steps({"a", "b"}, {5, 3})},
          "makes no lines that a trigger begins");
  refused(mixed, api::MovePath{.motors = {"a", "b"}, .rows = 1, .positions = {5, 3}},
          "makes runs of tables and lines, but no paths");
  Table uneven(2, ports(2, {}, "tick_us = 5000\n"));
  uneven.connect();
  refused(uneven, line({"a", "b"}), "Give both the same tick_us");
}

TEST(SerialLines, MotorsOfOneMoveEachByTheirOwnRunAreNoLine) {
  Whole lab;
  lab.connect();
  const Answer answer = lab.ask(Ask::kMoveBy, {"a", "b"}, {500, 200});
  EXPECT_EQ(answer.result, "reached");
  EXPECT_EQ(answer.reason.find("apart"), std::string::npos) << answer.reason;
}

// Whatever is asked and whenever: what is told is what the lines of bytes did, and nothing was
// earlier than the cruise delay.
TEST(SerialLines, CountsEveryStepOfADayOfOrders) {
  const unsigned seed = std::random_device{}();
  std::printf("  seed %u\n", seed);
  std::mt19937 random(seed);
  const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
  Whole lab(3);
  lab.drive(0).attach_switch(1, {.at_steps = 2500, .positive_end = true, .bounce_ns = 2'000'000});
  lab.drive(2).attach_switch(2, {.at_steps = -2500, .bounce_ns = 2'000'000});
  lab.connect();
  for (int i = 0; i < 150; ++i) {
    switch (below(9)) {
      case 0:
        lab.send(Ask::kStop, {"b"});
        break;
      case 1:
        lab.send(api::Pause{{"a"}});
        lab.run_for(0.01 * below(40));
        lab.send(api::Resume{{"a"}});
        break;
      case 2:
        lab.stall_pulses(true, static_cast<std::size_t>(below(3)));
        lab.run_for(0.001 * below(100));
        lab.stall_pulses(false);
        break;
      case 3:
        lab.send(Ask::kMoveTo, {"c"}, {below(5000) - 2500});
        break;
      default:
        lab.send(api::MoveLine{
            .kind = api::Move::Kind::kAbsolute,
            .motors = motor_steps({"a", "b", "c"},
                                  {below(5400) - 2700, below(900) - 450, below(5400) - 2700})});
    }
    lab.run_for(0.001 * below(1200));
    if (below(12) == 0) lab.pause_daemon(0.001 * below(200));
  }
  lab.run_for(20);
  lab.ask(Ask::kStop, {"a", "b", "c"});
  lab.run_for(1);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string name(1, static_cast<char>('a' + i));
    EXPECT_EQ(lab.motor(name).position_steps, lab.drive(i).position_steps()) << name;
    EXPECT_EQ(lab.motor(name).trust, api::Trust::kKnown) << lab.motor(name).uncertain_reason;
    EXPECT_EQ(lab.motor(name).activity, api::Activity::kResting) << name;
    EXPECT_EQ(lab.drive(i).faults(), 0u) << name;
    ASSERT_NO_FATAL_FAILURE(lab.expect_no_faster(i));
  }
}

}  // namespace
}  // namespace bushd::test
