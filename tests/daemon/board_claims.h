// What is so of a commutator board of either clock.
#pragma once

#include <gmock/gmock.h>

#include "daemon/board_lab.h"

namespace bushd::test {

// A lab in which nothing has moved: m5 makes so many steps to the left.
inline void expect_header_and_codes(BoardLab& lab, std::int64_t steps,
                                    const std::vector<std::int64_t>& codes) {
  const Answer answer = lab.move("m5", -steps);
  EXPECT_EQ(answer.result, "reached") << answer.reason;
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{-steps});
  EXPECT_EQ(lab.shaft_steps("m5"), -steps);
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
  std::vector<std::uint8_t> expected{0, 0x8D};
  const auto n = static_cast<std::size_t>(steps);
  for (std::size_t k = 0; k < n; ++k) {
    expected.push_back(static_cast<std::uint8_t>(code_of_step(codes, k, n)));
  }
  EXPECT_EQ(lab.sent, expected);
  EXPECT_TRUE(lab.trusted("m5"));
  EXPECT_TRUE(lab.errors().empty());
}

// A stop at full speed sends the whole side of the table.
inline void expect_stop_by_ramp(BoardLab& lab, const std::vector<std::int64_t>& codes) {
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(1000);
  lab.ask(Ask::kStop, {"m0"});
  const Answer answer = lab.wait(move);
  EXPECT_EQ(answer.result, "stopped");
  const std::int64_t made = lab.shaft_steps("m0");
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{made});
  // And what was under way.
  EXPECT_GE(made, 1238);
  EXPECT_LE(made, 1260);
  ASSERT_GE(lab.sent.size(), 240u);
  const std::vector<std::int64_t> last(lab.sent.end() - 238, lab.sent.end());
  EXPECT_EQ(last, std::vector<std::int64_t>(codes.rbegin(), codes.rend()));
  EXPECT_TRUE(lab.trusted("m0"));
  EXPECT_EQ(lab.move("m0", -made).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m0"), 0);
}

// Along the ramp, or at once.
inline void expect_emergency_stop(BoardLab& lab, bool immediate) {
  const auto move = lab.send(Ask::kMoveBy, {"m0"}, {20'000});
  lab.moves(1000);
  const std::int64_t at = lab.shaft_steps("m0");
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  const Answer answer = lab.wait(move);
  EXPECT_NE(answer.result, "reached");
  const std::int64_t made = lab.shaft_steps("m0") - at;
  EXPECT_GE(made, immediate ? 0 : 238);
  EXPECT_LE(made, immediate ? 2 : 241);
  EXPECT_EQ(answer.position_steps, std::vector<std::int64_t>{lab.shaft_steps("m0")});
  EXPECT_EQ(lab.move("m0", 10).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  EXPECT_EQ(lab.trusted("m0"), !immediate);
  lab.ask(Ask::kSetPosition, {"m0"}, {0});
  EXPECT_EQ(lab.move("m0", 10).result, "reached");
}

// A table with steps of the least time can be used, one with shorter ones cannot, as the
// configuration is refused that names it.
inline void expect_least_step_us(BoardLab& lab, int least_us, const std::string& why) {
  const auto file = [&](const std::string& name, int us) {
    lab.write_file(name + ".toml", "name = \"" + name + "\"\ntime_unit_ns = 1000\naccel = [9000, " +
                                       std::to_string(us) + "]\n");
  };
  file("swift", least_us - 1);
  file("just", least_us);
  const Answer swift = lab.wait(lab.use("axes", "swift"));
  EXPECT_NE(swift.result, "done");
  EXPECT_THAT(swift.reason, testing::HasSubstr(why));
  EXPECT_THAT(lab.wait(lab.use("axes", "just")), Ends("done"));
}

}  // namespace bushd::test
