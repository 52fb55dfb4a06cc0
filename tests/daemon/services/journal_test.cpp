#include "daemon/services/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/bench.h"

namespace bushd::daemon {
namespace {

using test::Bench;

TEST(Journal, AMoveAndItsEndHaveOneId) {
  Bench bench;
  Journal journal(bench.installation, bench);
  bench.installation[MotorId{2}].start(40, 100);
  journal.started({2}, 40, 100, 0, false);
  journal.changed({2}, {.at = 120, .target_steps = {}});
  journal.ended({2}, "stopped");
  ASSERT_EQ(bench.lines.size(), 3u);
  const auto begun = nlohmann::json::parse(bench.lines[0]);
  EXPECT_EQ(begun["event"], "move");
  EXPECT_EQ(begun["motor"], "m03");
  EXPECT_EQ(begun["address"], 2);
  EXPECT_EQ(begun["steps"], 40);
  EXPECT_GT(begun["id"], 1'000'000) << "another daemon's ids are not used again";
  EXPECT_EQ(nlohmann::json::parse(bench.lines[1])["event"], "stop");
  EXPECT_EQ(nlohmann::json::parse(bench.lines[2])["id"], begun["id"]);
}

}  // namespace
}  // namespace bushd::daemon
