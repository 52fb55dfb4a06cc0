#include "tools/bushctl/envelope_move.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tables/temp_directory.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace tables = bushd::tables;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kFeedTable = "name = \"feed\"\ntime_unit_ns = 100000\naccel = [80, 40, 20]\n";

class EnvelopeMove : public testing::Test {
 protected:
  EnvelopeMove() { directory_.write("feed.toml", kFeedTable); }

  bushd::Result<EnvelopeFile> read(const std::string& keys) {
    return read_envelope(directory_.write("in.envelope", "table = \"feed\"\n" + keys).string());
  }
  // In steps; or 400 of them a mm, backwards, and at 50 mm where the counter is 0.
  Whereabouts motor(bool mm = false) {
    const auto table = read("zones = [[0, 1]]\nend = 2\n")->table;
    Whereabouts motor;
    motor.state = {.name = "feed", .position_steps = 1000, .trust = api::Trust::kKnown};
    motor.description.name = "feed";
    motor.description.table = {.name = "feed", .revision = 0, .hash = table->short_hash()};
    if (mm) {
      motor.description.scale = {
          .unit = "mm", .steps_per_unit = {400, 1}, .negative = true, .offset = 50};
    }
    return motor;
  }
  api::MovePath path(const std::string& keys, const Whereabouts& of) {
    const auto envelope = read(keys);
    EXPECT_TRUE(envelope) << envelope.error().text();
    const auto made = envelope_path(*envelope, of, "");
    EXPECT_TRUE(made) << made.error().text();
    return made ? made->front() : api::MovePath{};
  }
  std::string refusal(const std::string& keys, const Whereabouts& of) {
    const auto envelope = read(keys);
    if (!envelope) return envelope.error().text();
    const auto made = envelope_path(*envelope, of, "");
    return made ? "taken" : made.error().text();
  }

  const bushd::test::TempDirectory directory_;
};

TEST_F(EnvelopeMove, ByDistanceBeginsWhereTheMotorStands) {
  const api::MovePath made = path("zones = [[0, 100], [10, 250]]\nend = 30\n", motor());
  EXPECT_THAT(made.motors, ElementsAre("feed"));
  EXPECT_THAT(made.positions, ElementsAre(1010, 1030));
  EXPECT_THAT(made.speeds, ElementsAre(100, 250));
  EXPECT_EQ(made.rows, 2);
  EXPECT_FALSE(made.speed);
}

TEST_F(EnvelopeMove, ByPositionHasAWayToItsFirstZone) {
  const api::MovePath made =
      path("by = \"position\"\nzones = [[500, 100], [400, 250]]\nend = -30\n", motor());
  EXPECT_THAT(made.positions, ElementsAre(500, 400, -30));
  EXPECT_THAT(made.speeds, ElementsAre(0, 100, 250));
}

TEST_F(EnvelopeMove, OfAMotorWithAUnitIsInThatUnit) {
  // At 47.5 mm.
  const std::string keys = "zones = [[0, 0.5], [1, 1.25]]\nend = 2\nsteps_per_unit = 400\n";
  const api::MovePath made = path(keys, motor(true));
  EXPECT_THAT(made.positions, ElementsAre(48.5, 49.5));
  EXPECT_THAT(made.speeds, ElementsAre(0.5, 1.25));
  // In steps the counter rises where the user's position falls.
  const api::MovePath steps = path("zones = [[0, 100], [400, 500]]\nend = 800\n", motor(true));
  EXPECT_THAT(steps.positions, ElementsAre(46.5, 45.5));
  EXPECT_THAT(steps.speeds, ElementsAre(0.25, 1.25));
}

TEST_F(EnvelopeMove, WhatDoesNotFitIsRefusedWithCauseAndRemedy) {
  const std::string keys = "zones = [[0, 100], [10, 250]]\nend = 30\n";
  EXPECT_THAT(refusal("zones = [[0, 100], [10, 501]]\nend = 30\n", motor()), "taken");
  EXPECT_THAT(refusal("zones = [[0, 100], [10, 550]]\nend = 30\n", motor()),
              HasSubstr("in.envelope: zones[1]: has 550 steps/s, and the table \"feed\" reaches "
                        "500; use a lower speed"));
  Whereabouts other = motor();
  other.description.table.hash = "00000000";
  EXPECT_THAT(refusal(keys, other), HasSubstr("and feed goes by \"feed\", content 00000000"));
  const std::string slow = "zones = [[0, 1], [10, 2]]\nend = 30\n";
  EXPECT_THAT(refusal(slow + "steps_per_unit = 100\n", motor(true)),
              HasSubstr("steps_per_unit: is 100, and feed has 400 per mm"));
  EXPECT_THAT(refusal(keys + "steps_per_unit = 1\n", motor()), HasSubstr("feed has 1 per steps"));
  Whereabouts moving = motor();
  moving.state.moving = true;
  EXPECT_THAT(refusal(keys, moving), HasSubstr("feed moves, and an envelope by distance begins"));
  Whereabouts unknown = motor();
  unknown.state.trust = api::Trust::kUnknown;
  EXPECT_THAT(refusal(keys, unknown), HasSubstr("nobody knows where it stands"));
  EXPECT_THAT(read_envelope((directory_.path() / "out.envelope").string()).error().text(),
              HasSubstr("out.envelope: cannot be read: No such file"));
}

}  // namespace
}  // namespace bushctl
