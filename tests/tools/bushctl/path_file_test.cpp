#include "tools/bushctl/path_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "results.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::test::good;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(PathFile, NamesMotorsAndTheirPositions) {
  const auto path = good(parse_path("# scan\nx, y\n\n0, 1.5\n-2, 3\n", "scan.csv", "exact", "2.5"));
  ASSERT_EQ(path.parts.size(), 1u);
  const api::MovePath& part = path.parts.front();
  EXPECT_THAT(part.motors, ElementsAre("x", "y"));
  EXPECT_THAT(part.positions, ElementsAre(0, 1.5, -2, 3));
  EXPECT_EQ(part.rows, 2);
  EXPECT_EQ(part.first_row, 0);
  EXPECT_EQ(part.corners, api::MovePath::Corners::kExact);
  EXPECT_EQ(part.speed, (api::Speed{.per_s = 2.5}));
  EXPECT_EQ(path.located("point 2, y: too far"), "scan.csv, line 5, y: too far");
  EXPECT_EQ(path.located("point 3, y: too far"), "point 3, y: too far");
  EXPECT_EQ(path.located("m: moves"), "m: moves");
}

TEST(PathFile, IsSentInParts) {
  std::string text = "a,b,c\n";
  for (int i = 0; i < 3000; ++i) text += std::to_string(i) + ",0,1\n";
  const auto path = good(parse_path(text, "long.csv", "continuous", ""));
  ASSERT_EQ(path.parts.size(), 3u);
  std::int32_t rows = 0;
  for (const api::MovePath& part : path.parts) {
    EXPECT_EQ(part.rows, 3000);
    EXPECT_EQ(part.first_row, rows);
    EXPECT_LE(part.positions.size(), api::MovePath::kValues.most);
    EXPECT_EQ(part.positions.front(), rows);
    rows += static_cast<std::int32_t>(part.positions.size() / 3);
  }
  EXPECT_EQ(rows, 3000);
}

TEST(PathFile, SaysWhereItIsWrong) {
  const auto why = [](const char* text, const char* speed = "") {
    const auto path = parse_path(text, "p.csv", "exact", speed);
    return path ? std::string() : path.error().text();
  };
  EXPECT_THAT(why("x,y\n1,2\n1,z\n"), HasSubstr("3"));
  EXPECT_THAT(why("x,y\n"), HasSubstr("p.csv"));
  EXPECT_THAT(why("x\n1\n", "-1"), HasSubstr("--speed"));
  EXPECT_EQ(parse_path("x\n1\n", "p.csv", "exact", "", "2.5")->parts[0].feed,
            (api::Speed{.per_s = 2.5}));
  EXPECT_THAT(parse_path("x\n1\n", "p.csv", "exact", "", "-1").error().message,
              HasSubstr("--feed"));
}

TEST(SpeedProfile, IsAPathOfOneMotor) {
  const auto profile = good(parse_speed_profile(
      {"theta", "--to", "400", "--speed-at", "100:2.5", "--speed-at=300:5"}, Numbers::kUser, "9"));
  ASSERT_EQ(profile.size(), 1u);
  const api::MovePath& path = profile.front();
  EXPECT_THAT(path.motors, ElementsAre("theta"));
  EXPECT_THAT(path.positions, ElementsAre(100, 300, 400));
  EXPECT_THAT(path.speeds, ElementsAre(0, 2.5, 5));
  EXPECT_EQ(path.rows, 3);
  EXPECT_EQ(path.speed, (api::Speed{.per_s = 9}));
  EXPECT_TRUE(parse_speed_profile({"theta", "400"}, Numbers::kUser, "")->empty());
}

TEST(SpeedProfile, RefusesWhatItCannotBe) {
  const auto good = [](const std::vector<std::string>& words, Numbers numbers = Numbers::kUser) {
    return parse_speed_profile(words, numbers, "").has_value();
  };
  EXPECT_FALSE(good({"theta", "400", "--speed-at", "100:2"}));
  EXPECT_FALSE(good({"theta", "--to", "400", "--speed-at"}));
  EXPECT_FALSE(good({"theta", "--to", "400", "--speed-at", "100"}));
  EXPECT_FALSE(good({"theta", "--to", "400", "--speed-at", "100:0"}));
  EXPECT_FALSE(good({"theta", "--to", "400", "--speed-at", "100:2"}, Numbers::kSteps));
  EXPECT_FALSE(good({"a", "--to", "4", "b", "--to", "2", "--speed-at", "1:2"}));
}

}  // namespace
}  // namespace bushctl
