#include "daemon/services/homing_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/live_bench.h"
#include "daemon/services/stops.h"

namespace bushd::daemon {
namespace {

using test::Bench;
using test::LiveBench;
using testing::HasSubstr;

// One MCU with two motors, each with a home switch.
std::string homes() {
  const std::string home =
      "home = { direction = \"negative\", position_steps = -50, most_steps = 6000 }\n";
  return test::with_keys(test::with_keys(test::hall(1, 2), "m01", home), "m02", home);
}

struct HomingBench : LiveBench {
  // `on_its_own`: homing has its steps, and nobody stops it.
  explicit HomingBench(const std::string& toml = homes(), bool on_its_own = false)
      : LiveBench(toml) {
    for (std::size_t output = 0; output < 2; ++output) {
      line.mcu(0).attach_switch(output, {.at_steps = -150});
    }
    connect(on_its_own ? static_cast<Service&>(homing) : stops);
  }
  void send(BusId bus, std::span<const std::uint8_t> bytes) override {
    for (const std::uint8_t byte : bytes) {
      bushd_frame frame;
      if (bushd_receive_byte(&sent_, byte, &frame) != BUSHD_RECEIVE_FRAME) continue;
      homes_asked += frame.type == BUSHD_MSG_HOME;
    }
    LiveBench::send(bus, bytes);
  }
  Stops stops{installation, moves, homing, travels, programs, local_inputs, open_moves};
  int homes_asked = 0;

 private:
  bushd_receiver sent_{};
};

TEST(HomingQueue, MotorsOfAnMcuAreHomedOneAfterTheOther) {
  HomingBench bench;
  bench.homing.request(bench.asker(1), api::Home{{"m01", "m02"}});
  EXPECT_FALSE(bench.homing.empty());
  ASSERT_TRUE(bench.run_until([&] { return bench.shaft_steps("m01") < -20; }));
  EXPECT_EQ(bench.shaft_steps("m02"), 0) << "it waits";
  EXPECT_TRUE(bench.of("m02").is<motion::Homing>());
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kReached) << result.reason;
  EXPECT_TRUE(bench.homing.empty());
  EXPECT_FALSE(bench.of("m02").trust().uncertain_reason());
}

// The next of a sequence begins when the one before has moved on: its MCU is asked once.
TEST(HomingQueue, EachMotorIsAskedForOnce) {
  std::string toml = homes();
  const std::string first = "position_steps = -50";
  toml.replace(toml.find(first), first.size(), first + ", then = 20");
  toml.replace(toml.rfind(first + ", most"), first.size(), first + ", order = 2");
  HomingBench bench(toml, true);
  bench.homing.request(bench.asker(1), api::Home{.all = true});
  const api::Completed result = bench.result(1);
  EXPECT_EQ(result.outcome, api::Outcome::kReached) << result.reason;
  EXPECT_EQ(bench.homes_asked, 2);
}

TEST(HomingQueue, StopEndsIt) {
  HomingBench bench;
  bench.homing.request(bench.asker(1), api::Home{{"m01", "m02"}});
  ASSERT_TRUE(bench.run_until([&] { return bench.shaft_steps("m01") < -20; }));
  bench.stops.request(bench.now_us(), bench.asker(2), {});
  EXPECT_EQ(bench.result(2).outcome, api::Outcome::kDone);
  EXPECT_EQ(bench.result(1).outcome, api::Outcome::kStopped);
  EXPECT_EQ(bench.shaft_steps("m02"), 0);
}

TEST(HomingQueue, OneThatWaitsForTheTriggerIsToldAsSuch) {
  HomingBench bench;
  bench.installation[bench.motor("m01")].arm(1, 40, 0);
  bench.homing.request(bench.asker(1), api::Home{{"m01"}});
  EXPECT_THAT(bench.refusal(1),
              HasSubstr("m01: waits for the trigger; run 'bushctl disarm m01' first"));
}

TEST(HomingQueue, AMotorWithoutAHomeIsRefusedWithTheRemedy) {
  LiveBench bench;
  Stops stops(bench.installation, bench.moves, bench.homing, bench.travels, bench.programs,
              bench.local_inputs, bench.open_moves);
  bench.connect(stops);
  bench.homing.request(bench.asker(1), api::Home{{"m02"}});
  EXPECT_THAT(bench.refusal(1), HasSubstr("no home switch configured: add 'home = {...}' to motor "
                                          "\"m02\""));
}

}  // namespace
}  // namespace bushd::daemon
