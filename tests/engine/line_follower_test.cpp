#include "engine/line_follower.h"

#include <algorithm>
#include <cstdint>

#include "engine/line.h"
#include "engine/line_motor.h"
#include "engine/properties.h"

namespace bushd::test::line_follower_test {
namespace {

TEST(LineFollower, IsWhereTheLineIs) {
  holds("steps made and position are those of bushd_line_position", [] {
    const LineMotor motor = any_line_motor(1);
    const auto from = between<uint32_t>(0, motor.longest - 1);
    bushd_line_follower follower;
    bushd_line_follower_start(&follower, motor.increment, motor.longest, from);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    bushd_line_go_to(&line, from);
    uint64_t made = line.made;
    const uint32_t last = std::min(motor.longest, from + 60);
    for (uint32_t step = from + 1; step <= last; ++step) {
      for (unsigned parts = 0; parts <= 256; parts += 1 + between(0u, 255u)) {
        while (bushd_line_follower_due(&follower, step, static_cast<uint16_t>(parts))) {
          bushd_line_follower_step(&follower);
          ++made;
        }
        if (parts == 256) continue;
        const auto part = static_cast<uint8_t>(parts);
        const auto fraction = bushd_line_follower_fraction(&follower, motor.longest, step, part);
        RC_ASSERT(made * 256 + fraction == bushd_line_position(&line, part));
      }
      while (bushd_line_follower_due(&follower, step, 256)) {
        bushd_line_follower_step(&follower);
        ++made;
      }
      bushd_line_follow(&line, 1);
      RC_ASSERT(made == line.made);
    }
  });
}

TEST(LineFollower, NeverHasTwoStepsInOneOfTheRun) {
  holds("a step of the run apart at least", [] {
    const LineMotor motor = any_line_motor(1);
    bushd_line_follower follower;
    bushd_line_follower_start(&follower, motor.increment, motor.longest,
                              between<uint32_t>(0, motor.longest));
    for (int i = 0; i < 50 && follower.due_step <= motor.longest; ++i) {
      const uint64_t before = (uint64_t{follower.due_step} << 8) + follower.due_part;
      bushd_line_follower_step(&follower);
      RC_ASSERT((uint64_t{follower.due_step} << 8) + follower.due_part >= before + 256);
    }
  });
}

TEST(LineFollower, OfTheLongestStepsWithTheRun) {
  for (const uint32_t longest : {1u, 2u, 77u, kLongest}) {
    bushd_line_follower follower;
    bushd_line_follower_start(&follower, longest, longest, 0);
    for (uint32_t step = 1; step <= std::min(longest, 100u); ++step) {
      ASSERT_FALSE(bushd_line_follower_due(&follower, step, 255));
      ASSERT_TRUE(bushd_line_follower_due(&follower, step, 256));
      bushd_line_follower_step(&follower);
    }
  }
}

}  // namespace
}  // namespace bushd::test::line_follower_test
