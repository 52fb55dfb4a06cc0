// Nothing begins to move while the daemon ends, while an emergency stop is not over, or on a line
// that another master has: neither what is asked nor what begins by itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "daemon/lab.h"
#include "engine/frame.h"

namespace bushd::test {
namespace {

constexpr const char* kHomeOfBegins = "home = { direction = \"negative\", most_steps = 6000";

// m01 at a bus of its own, "far" at another one.
std::string hall_and_lab(const std::string& keys_of_far) {
  return hall(1, 1) +
         "[[bus]]\nname = \"lab\"\nport = \"/dev/null1\"\nbaud = 500000\ntick_us = 2560\n"
         "format = \"fine\"\n[[mcu]]\nbus = \"lab\"\naddress = 1\n"
         "[[motor]]\nname = \"far\"\nmcu = \"lab:1\"\noutput = 0\ngroup = \"axes\"\n" +
         keys_of_far + "\n";
}

TEST(Begins, NoHomingAtTheStartOfAnMcuThatComesWhileTheDaemonEnds) {
  Lab lab(hall_and_lab(std::string(kHomeOfBegins) + ", at_start = true }"));
  lab.unplug(1);
  const auto ready = [&lab](const char* mcu) {
    return lab.has_state(mcu) && lab.state_of(mcu).state == api::McuState::kReady;
  };
  ASSERT_TRUE(lab.run_until([&] { return ready("hall:1"); }));
  EXPECT_EQ(lab.ask(api::Confirm{{"m01"}}).result, "done");
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1.5);
  lab.core().shut_down(lab.now_us());
  lab.plug(1);
  EXPECT_EQ(lab.wait(move).result, "stopped");
  ASSERT_TRUE(lab.run_until([&] { return lab.core().at_rest(); }));
  lab.run_for(3);
  EXPECT_FALSE(ready("lab:1")) << "nobody enables its drivers any more";
  EXPECT_EQ(lab.shaft_steps("far"), 0);
  EXPECT_TRUE(lab.core().at_rest());
}

// One that waits for its turn when the daemon is told to end does not begin either.
TEST(Begins, NoHomingThatWaitsWhenTheDaemonEnds) {
  std::string toml = with_keys(hall(1, 2), "m01", std::string(kHomeOfBegins) + " }\n");
  ReadyLab lab(with_keys(toml, "m02", std::string(kHomeOfBegins) + " }\n"));
  const auto home = lab.send(Ask::kHome, {"m01", "m02"});
  lab.run_for(0.5);
  lab.core().shut_down(lab.now_us());
  EXPECT_EQ(lab.wait(home).result, "stopped");
  lab.run_for(3);
  EXPECT_EQ(lab.shaft_steps("m02"), 0);
}

// Frames of another master, before what the daemon sends.
void talk_as_another(Lab& lab) {
  lab.on_send = [id = 100u](std::size_t, std::vector<std::uint8_t>& bytes) mutable {
    bushd_sync sync{};
    sync.master = 4711;
    sync.sync_id = ++id;
    std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> payload{};
    std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire{};
    const std::size_t size = bushd_encode_sync(&sync, payload.data());
    const std::size_t n = bushd_frame_encode(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, 0,
                                             payload.data(), size, wire.data());
    bytes.insert(bytes.begin(), wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(n));
    return true;
  };
}

// The last approach is a run of its own, and begins when the first leg is over.
TEST(Begins, NoLegOfAMoveOnALineThatAnotherMasterHas) {
  ReadyLab lab(
      with_keys(hall(1, 2), "m01", "unit = \"mm\"\nsteps_per_unit = 400\nbacklash = 0.1\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-3000});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") < -300; }));
  talk_as_another(lab);
  const Answer ended = lab.wait(move);
  EXPECT_THAT(ended, Ends("stopped", "another master talks on bus hall"));
  EXPECT_EQ(lab.shaft_steps("m01"), -3040) << "where its first leg has led";
  EXPECT_EQ(ended.position_steps[0], -3040);
}

}  // namespace
}  // namespace bushd::test
