#include "engine/line.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "engine/line_motor.h"
#include "engine/properties.h"

namespace bushd::test::line_test {
namespace {

// Exact, from the definition: numbers over a common denominator in 128 bits.
__extension__ typedef __int128 Wide;

Wide shortest_delay_of(Wide numerator, Wide denominator) {
  const Wide quotient = numerator / denominator;
  return numerator % denominator < 0 ? quotient - 1 : quotient;
}

// floor( r (s - 1/2) + 1/2 ) for s = x / 256, which is a step of the run and a part of the next.
Wide made_at(Wide increment, Wide longest, Wide x) {
  return shortest_delay_of(increment * (x - 128) + 128 * longest, 256 * longest);
}

// The position in 1/256 step: half a step of the run is the least that is told apart.
Wide position_at(Wide increment, Wide longest, Wide x) {
  const Wide ruled = shortest_delay_of(increment * (x - 128) + 128 * longest, longest);
  return std::min(ruled, shortest_delay_of(2 * increment * x, longest));
}

TEST(Line, EveryStepIsWhereTheRulePutsIt) {
  holds("made = floor(r (s - 1/2) + 1/2)", [] {
    const LineMotor motor = any_line_motor(0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    RC_ASSERT(line.made == 0u);
    const auto from = between<uint32_t>(0, motor.longest);
    bushd_line_go_to(&line, from);
    RC_ASSERT(Wide{line.made} == made_at(motor.increment, motor.longest, Wide{from} * 256));
    uint32_t s = from;
    while (s < std::min(motor.longest, from + std::min<uint32_t>(motor.longest - from, 300))) {
      const uint32_t steps = between<uint32_t>(1, std::min<uint32_t>(motor.longest - s, 20));
      const uint32_t before = line.made;
      const uint32_t made = bushd_line_follow(&line, steps);
      s += steps;
      RC_ASSERT(line.made - before == made);
      RC_ASSERT(Wide{line.made} == made_at(motor.increment, motor.longest, Wide{s} * 256));
    }
  });
}

TEST(Line, EndsAtItsIncrements) {
  holds("all steps are made at s = L", [] {
    const LineMotor motor = any_line_motor(0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    bushd_line_go_to(&line, motor.longest);
    RC_ASSERT(line.made == motor.increment);
  });
}

TEST(Line, IsWithinHalfAStepOfItsPoint) {
  holds("|made - r (s - 1/2)| <= 1/2", [] {
    const LineMotor motor = any_line_motor(0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    const auto s = between<uint32_t>(1, motor.longest);
    bushd_line_go_to(&line, s);
    const Wide twice =
        2 * Wide{motor.longest} * line.made - Wide{motor.increment} * (2 * Wide{s} - 1);
    RC_ASSERT(twice <= Wide{motor.longest} && twice >= -Wide{motor.longest});
  });
}

TEST(Line, TellsInWhichStepOfTheRunAStepFalls) {
  holds("the least s with so many made", [] {
    const LineMotor motor = any_line_motor(0);
    RC_PRE(motor.increment > 0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    const auto step = between<uint32_t>(1, motor.increment);
    const uint32_t s = bushd_line_run_step(&line, step);
    bushd_line_go_to(&line, s);
    RC_ASSERT(line.made == step);
    bushd_line_go_to(&line, s - 1);
    RC_ASSERT(line.made == step - 1);
  });
}

// Ties, in which the motor makes its step just with the run's, go to the later step in one
// direction and to the earlier one in the other.
TEST(Line, ReversedMakesTheSamePattern) {
  holds("steps of the reversed line, from its end", [] {
    const auto longest = between<uint32_t>(1, 300);
    const auto increment = between<uint32_t>(1, longest);
    bushd_line line;
    bushd_line_start(&line, increment, longest);
    for (uint32_t step = 1; step <= increment; ++step) {
      const Wide doubled = (2 * Wide{step} - 1) * longest + increment;  // s x 2 N
      const uint32_t s = bushd_line_run_step(&line, step);
      const uint32_t reversed = longest + 1 - bushd_line_run_step(&line, increment + 1 - step);
      RC_ASSERT(s == (doubled % (2 * increment) == 0 ? reversed : reversed + 1));
    }
  });
}

TEST(Line, PositionsBetweenStepsFollowTheSameRule) {
  holds("positions at a fraction of a step of the run", [] {
    const LineMotor motor = any_line_motor(0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    // Near the beginning, where the position rises from 0, or anywhere.
    const uint32_t most = motor.longest - 1;
    const auto s = between<uint32_t>(0, between(0, 1) == 0 ? std::min<uint32_t>(most, 9) : most);
    const auto fraction = between<uint8_t>(0, 255);
    bushd_line_go_to(&line, s);
    const Wide x = Wide{s} * 256 + fraction;
    const uint64_t position = bushd_line_position(&line, fraction);
    RC_ASSERT(Wide{position} == position_at(motor.increment, motor.longest, x));
    // So that it crosses a whole number where the motor makes a step.
    RC_ASSERT(Wide{position / 256} ==
              std::max<Wide>(made_at(motor.increment, motor.longest, x), 0));
  });
}

TEST(Line, CrossesAtTheLeastFractionThatItTells) {
  holds("the fraction at which a step is made", [] {
    const LineMotor motor = any_line_motor(0);
    RC_PRE(motor.increment > 0);
    bushd_line line;
    bushd_line_start(&line, motor.increment, motor.longest);
    bushd_line_go_to(&line, between<uint32_t>(0, motor.longest - 1));
    RC_PRE(line.made < motor.increment);
    const uint64_t next = (uint64_t{line.made} + 1) * 256;
    const uint16_t crossing = bushd_line_crossing(&line);
    if (crossing < 256) {
      RC_ASSERT(bushd_line_position(&line, static_cast<uint8_t>(crossing)) >= next);
    }
    if (crossing > 0) {
      RC_ASSERT(bushd_line_position(&line, static_cast<uint8_t>(crossing - 1)) < next);
    }
  });
}

// V. M. Ivanov's evaluation function of two coordinates, doubled: 2 F = 2 (a_k b - b_k a) with a_k,
// b_k the increments of the frame and a, b what is made of them. F > 0: a step along alpha. F < 0:
// a step along beta. He begins at F = 0. Here it begins at a_k - b_k, by which both begin half a
// step behind, so that the path lies around the line and not on one side of it.
class CentredEvaluation {
 public:
  CentredEvaluation(int64_t alpha, int64_t beta)
      : increments_{alpha, beta}, value_(std::abs(alpha) - std::abs(beta)) {}

  // Whose step is next: of alpha, of beta; nobody's: a tie.
  bool alpha_is_next() const { return value_ > 0; }
  bool beta_is_next() const { return value_ < 0; }
  void step(int axis) {
    at_[axis] += increments_[axis] < 0 ? -1 : 1;
    value_ += axis == 0 ? -2 * std::abs(increments_[1]) : 2 * std::abs(increments_[0]);
  }
  int64_t at(int axis) const { return at_[axis]; }

 private:
  int64_t increments_[2];
  int64_t at_[2] = {0, 0};
  int64_t value_;
};

TEST(Line, OrderOfStepsIsThatOfACentredEvaluationFunctionInAllQuadrants) {
  holds("each step of the run makes what the evaluation function asks for", [] {
    const int64_t increments[2] = {between<int64_t>(-60, 60), between<int64_t>(-60, 60)};
    RC_PRE(increments[0] != 0 && increments[1] != 0);
    const int leading = std::abs(increments[0]) >= std::abs(increments[1]) ? 0 : 1;
    const int other = 1 - leading;
    const auto longest = static_cast<uint32_t>(std::abs(increments[leading]));
    bushd_line line;
    bushd_line_start(&line, static_cast<uint32_t>(std::abs(increments[other])), longest);
    CentredEvaluation evaluation(increments[0], increments[1]);
    for (uint32_t s = 1; s <= longest; ++s) {
      // The step of the run is that of the leading coordinate; the other one has made its own by
      // then. In a tie both are made.
      const bool other_before =
          leading == 0 ? !evaluation.alpha_is_next() : !evaluation.beta_is_next();
      const bool made = bushd_line_follow(&line, 1) != 0;
      RC_ASSERT(made == other_before);
      if (made) evaluation.step(other);
      const bool other_again =
          leading == 0 ? evaluation.beta_is_next() : evaluation.alpha_is_next();
      RC_ASSERT(!other_again);
      evaluation.step(leading);
      const int64_t sign = increments[other] < 0 ? -1 : 1;
      RC_ASSERT(evaluation.at(other) == sign * int64_t{line.made});
    }
    RC_ASSERT(evaluation.at(0) == increments[0] && evaluation.at(1) == increments[1]);
  });
}

}  // namespace
}  // namespace bushd::test::line_test
