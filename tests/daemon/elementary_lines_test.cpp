// Lines by the elementary law: made by one MCU, and judged at the pins by tools/check-trace, which
// works out the printed evaluation function by itself.
#include "daemon/motion_frames.h"
#include "daemon/on_line.h"
#include "daemon/traced.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kThree{"m01", "m02", "m03"};

api::MoveLine elementary_to(const std::vector<std::string>& motors,
                            const std::vector<std::int64_t>& steps) {
  api::MoveLine line = line_to(motors, steps);
  line.law = api::MoveLine::Law::kElementary;
  return line;
}

class ElementaryLine : public Traced<const char*> {};
INSTANTIATE_TEST_SUITE_P(Manners, ElementaryLine, testing::Values("fine", "coarse", "fine_table"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(ElementaryLine, IsMadeByItsMcuExactToASlot) {
  ReadyLab lab(hall(2, 4, GetParam()), {}, vcd_.get());
  MotionFrames sent;
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    sent.add(bytes);
    return true;
  };
  const auto reaches = [&](const std::vector<std::string>& motors,
                           const std::vector<std::int64_t>& steps) {
    EXPECT_THAT(lab.ask(elementary_to(motors, steps)),
                Ends("reached", "the line was limited by m0"));
    for (std::size_t i = 0; i < motors.size(); ++i) EXPECT_EQ(lab.shaft_steps(motors[i]), steps[i]);
  };
  // Named in another order than that of the outputs, which is that of the law.
  reaches({"m02", "m01"}, {-433, 700});
  reaches({"m01", "m02", "m03", "m04"}, {0, 0, 250, -1});
  reaches({"m04", "m02", "m03", "m01"}, {200, 199, 50, 198});
  reaches({"m03"}, {-40});
  EXPECT_EQ(sent.frames, 4) << "one LINE_RUN each";
  expect_clean(lab);
  close_trace(lab);
  EXPECT_EQ(check(lab, ""), 0) << said();
  EXPECT_THAT(said(), HasSubstr("farthest from the exact slot 0.0 us"));
  // It would say so if the order of steps had been another one.
  EXPECT_EQ(check(lab, "",
                  [](auto& event) {
                    if (event["event"] != "line" || event["motors"].size() != 2) return true;
                    std::swap(event["motors"][0]["output"], event["motors"][1]["output"]);
                    return true;
                  }),
            1);
}

TEST_P(ElementaryLine, StaysOnTheLineWhereItIsStoppedPausedAndChanged) {
  ReadyLab lab(hall(1, 3, GetParam()), {}, vcd_.get());
  const std::vector<std::int64_t> steps{3000, -1201, 170};
  const auto move = lab.send(elementary_to(kThree, steps));
  lab.run_for(0.4);
  lab.ask(api::Pause{{"m02"}});
  lab.run_for(1);
  EXPECT_LE(off_line(lab, kThree, steps), 1.0);
  EXPECT_GT(lab.shaft_steps("m01"), 0);
  EXPECT_LT(lab.shaft_steps("m01"), 3000);
  lab.send(api::Resume{{"m01"}});
  lab.run_for(0.4);
  auto slower = elementary_to(kThree, steps);
  slower.feed = api::Speed{.per_s = 900, .in_steps = true};
  const auto second = lab.send(slower);
  lab.run_for(0.4);
  EXPECT_EQ(lab.wait(move).result, "stopped");
  lab.ask(Ask::kStop, {"m03"});
  EXPECT_EQ(lab.wait(second).result, "stopped");
  EXPECT_THAT(lab.last_reply(second).reason, testing::Not(HasSubstr("off it")));
  EXPECT_LE(off_line(lab, kThree, steps), 1.0);
  EXPECT_EQ(lab.ask(elementary_to(kThree, steps)).result, "reached");
  expect_clean(lab, {"hall:1"});
  close_trace(lab);
  EXPECT_EQ(check(lab, ""), 0) << said();
}

TEST(ElementaryLines, ANearerEndIsOneThroughWhichTheLineLeads) {
  ReadyLab lab(hall(1, 2));
  const auto move = lab.send(elementary_to({"m01", "m02"}, {6000, 3000}));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  EXPECT_THAT(lab.ask(line_to({"m01", "m02"}, {3000, 1400})).reason,
              HasSubstr("is not on the line that is under way, which leads through"));
  EXPECT_EQ(lab.ask(line_to({"m01", "m02"}, {3000, 1500})).result, "reached");
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
  EXPECT_EQ(lab.shaft_steps("m02"), 1500);
}

TEST(ElementaryLines, AreOfOneMcuThatMakesThem) {
  ReadyLab lab(hall(2, 2));
  EXPECT_EQ(lab.ask(elementary_to({"m01", "m04"}, {5, 5})).reason,
            "m01 is connected to MCU hall:1 and m04 to hall:2: by the elementary law one MCU makes "
            "each step of the line; name motors of one MCU, or ask for the leading law");
  EXPECT_THAT(lab.ask(elementary_to({"m01", "m02"}, {1'500'000'000, 1'500'000'000})).reason,
              HasSubstr("by the elementary law a line has at most 2147483647"));
  const auto leading = lab.send(line_to({"m01", "m02"}, {2000, 2000}));
  lab.run_for(0.3);
  EXPECT_THAT(
      lab.ask(elementary_to({"m01", "m02"}, {1000, 1000})).reason,
      HasSubstr("the line under way is not by the elementary law, and a line keeps its law"));
  EXPECT_EQ(lab.wait(leading).result, "reached");
  const std::string denied =
      "makes no lines by the elementary law by itself: its firmware does not, or the bus has "
      "frames = \"ticks\"; ask for the leading law";
  for (const char* manner : {"fine", "fine_ticks"}) {
    ReadyLab other(hall(1, 2, manner), {}, nullptr,
                   std::string(manner) == "fine" ? BUSHD_CAN_ELEMENTARY : 0);
    EXPECT_EQ(other.ask(elementary_to({"m01", "m02"}, {5, 5})).reason, "MCU hall:1 " + denied);
  }
}

// v = h f, by either law where that is the same: of one motor.
TEST(ElementaryLines, AFeedIsThatOfElementarySteps) {
  ReadyLab lab(hall(1, 2));
  auto line = elementary_to({"m01", "m02"}, {3000, 2000});
  line.dry_run = true;
  line.feed = api::Speed{.per_s = 100, .in_steps = true};
  const auto plan = lab.ask(line).plan;
  ASSERT_TRUE(plan);
  EXPECT_NEAR(static_cast<double>(plan->duration_us), 50e6, 0.1e6);
  EXPECT_NEAR(plan->motors[0].peak_steps_per_s, 60, 0.01);
  EXPECT_NEAR(plan->motors[1].peak_steps_per_s, 40, 0.01);
  // The leading law: along the way.
  line = line_to({"m01", "m02"}, {3000, -4000});
  line.dry_run = true;
  line.feed = api::Speed{.per_s = 100, .in_steps = true};
  const auto leading = lab.ask(line).plan;
  ASSERT_TRUE(leading);
  EXPECT_NEAR(static_cast<double>(leading->duration_us), 50e6, 0.1e6);
  EXPECT_NEAR(leading->motors[0].peak_steps_per_s, 60, 0.1);
  EXPECT_NEAR(leading->motors[1].peak_steps_per_s, 80, 0.15);
  line.feed = api::Speed{.per_s = 1e9, .in_steps = true};
  const auto fast = lab.ask(line).plan;
  line.feed.reset();
  EXPECT_EQ(fast->duration_us, lab.ask(line).plan->duration_us);
  line.feed = api::Speed{.per_s = 1e-4, .in_steps = true};
  EXPECT_THAT(lab.ask(line).reason, HasSubstr("allowed: up to an hour a step"));
  line.feed = api::Speed{.per_s = -1};
  EXPECT_THAT(lab.ask(line).reason, HasSubstr("a feed of -1; allowed: any above 0"));
}

TEST(ElementaryLines, AFeedIsOfMotorsWithOneUnit) {
  const auto scaled = [](const std::string& first, const std::string& second) {
    return with_keys(with_keys(hall(1, 2), "m01", first), "m02", second);
  };
  const std::string mm = "unit = \"mm\"\nsteps_per_unit = 100\n";
  ReadyLab lab(scaled(mm, "unit = \"mm\"\nsteps_per_unit = 200\n"));
  auto line = line_to({"m01", "m02"}, {3000, 8000});  // 30 mm, 40 mm
  line.dry_run = true;
  line.feed = api::Speed{.per_s = 5};
  const auto plan = lab.ask(line).plan;
  ASSERT_TRUE(plan);
  // A step of 1.25 ms takes 32 units of 40 us, the next one that is no faster.
  EXPECT_NEAR(plan->motors[0].peak_steps_per_s, 300 * 31.25 / 32, 0.01);
  line.law = api::MoveLine::Law::kElementary;
  EXPECT_EQ(
      lab.ask(line).reason,
      "m01 has 100 steps per mm and m02 has 200: by the elementary law a feed is h f, with one "
      "step h for all; give a feed in steps, or ask for the leading law");
  ReadyLab mixed(scaled(mm, "unit = \"deg\"\nsteps_per_unit = 100\n"));
  line.law = api::MoveLine::Law::kLeading;
  EXPECT_EQ(
      mixed.ask(line).reason,
      "m01 is in mm and m02 in deg: a feed is along the way, so of motors with one unit; give a "
      "speed, which is of each motor in its own, or a feed in steps");
  ReadyLab equal(scaled(mm, mm));
  line.law = api::MoveLine::Law::kElementary;
  const auto same = equal.ask(line).plan;
  ASSERT_TRUE(same);
  EXPECT_NEAR(same->motors[0].peak_steps_per_s + same->motors[1].peak_steps_per_s, 500, 0.5);
}

// Along each segment, whatever its direction.
TEST(ElementaryLines, AFeedIsOfPathsToo) {
  const std::string mm = "unit = \"mm\"\nsteps_per_unit = 100\n";
  ReadyLab lab(with_keys(with_keys(hall(1, 2), "m01", mm), "m02", mm));
  api::MovePath path{.motors = {"m01", "m02"},
                     .rows = 3,
                     .positions = {30, 40, 80, 40, 80, -10},
                     .corners = api::MovePath::Corners::kExact,
                     .dry_run = true,
                     .feed = api::Speed{.per_s = 5}};
  const auto plan = lab.ask(path).plan;
  ASSERT_TRUE(plan);
  EXPECT_NEAR(static_cast<double>(plan->duration_us), 30e6, 1e6);
  EXPECT_NEAR(plan->motors[0].peak_steps_per_s, 500, 1);
  path.feed = api::Speed{.per_s = 1e-6};
  EXPECT_THAT(lab.ask(path).reason, HasSubstr("point 1, a feed of 1e-06 mm/s would take"));
}

}  // namespace
}  // namespace bushd::test
