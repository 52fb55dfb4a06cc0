#include "engine/elementary.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "engine/properties.h"

namespace bushd::test::elementary_test {
namespace {

// What V. M. Ivanov prints, and nothing else: formulas 3 to 5 for F, figure 5 for the beginning of
// a frame, figure 6 for a step and for its end.
class Printed {
 public:
  Printed(int64_t x, int64_t y)
      : alpha_end_(std::abs(x)), beta_end_(std::abs(y)), signs_{x < 0 ? -1 : 1, y < 0 ? -1 : 1} {}

  // One interrupt. Returns the coordinate that makes a step.
  int interrupt() {
    const int axis = f() >= 0 ? 0 : 1;
    (axis == 0 ? alpha_ : beta_) += 1;
    at_[axis] += signs_[axis];
    return axis;
  }
  // Cdr = End, by the coordinate with the larger increment.
  bool is_over() const {
    return alpha_end_ > beta_end_ ? alpha_ == alpha_end_ : beta_ == beta_end_;
  }
  int64_t at(int axis) const { return at_[axis]; }

 private:
  int64_t f() const { return alpha_end_ * beta_ - beta_end_ * alpha_; }

  int64_t alpha_end_;
  int64_t beta_end_;
  int64_t signs_[2];
  int64_t alpha_ = 0;
  int64_t beta_ = 0;
  int64_t at_[2] = {0, 0};
};

bushd_elementary line_of(const std::vector<uint32_t>& increments) {
  bushd_elementary line;
  bushd_elementary_clear(&line);
  for (size_t i = 0; i < increments.size(); ++i) {
    bushd_elementary_add(&line, static_cast<uint8_t>(i), increments[i]);
  }
  return line;
}

TEST(Elementary, TwoCoordinatesMakeWhatIsPrintedInAllQuadrants) {
  for (int x = -60; x <= 60; ++x) {
    for (int y = -60; y <= 60; ++y) {
      if (x == 0 || y == 0) continue;
      Printed printed(x, y);
      const auto along_x = static_cast<uint32_t>(std::abs(x));
      const auto along_y = static_cast<uint32_t>(std::abs(y));
      bushd_elementary line = line_of({along_x, along_y});
      int64_t at[2] = {0, 0};
      for (uint32_t s = 0; s < along_x + along_y; ++s) {
        ASSERT_FALSE(printed.is_over()) << x << " " << y << " " << s;
        const uint8_t axis = bushd_elementary_step(&line);
        ASSERT_EQ(axis, printed.interrupt()) << x << " " << y << " " << s;
        at[axis] += (axis == 0 ? x : y) < 0 ? -1 : 1;
        ASSERT_EQ(at[axis], printed.at(axis));
      }
      ASSERT_TRUE(printed.is_over()) << x << " " << y;
      ASSERT_EQ(printed.at(0), x);
      ASSERT_EQ(printed.at(1), y);
    }
  }
}

// The recurrence of engine/line.h, over S steps, with other first values: S - N of alpha, S - N - 1
// of beta.
TEST(Elementary, TwoCoordinatesAreTheRecurrenceOfTheOtherLawWithOtherFirstValues) {
  for (uint32_t alpha = 1; alpha <= 60; ++alpha) {
    for (uint32_t beta = 1; beta <= 60; ++beta) {
      const bushd_elementary line = line_of({alpha, beta});
      const uint32_t sum = alpha + beta;
      for (uint32_t s = 0; s <= sum; ++s) {
        ASSERT_EQ(bushd_elementary_made(&line, 0, s), (alpha * s + sum - alpha) / sum);
        ASSERT_EQ(bushd_elementary_made(&line, 1, s), (beta * s + sum - beta - 1) / sum);
      }
    }
  }
}

std::vector<uint32_t> any_increments(uint32_t most) {
  const auto count = between<size_t>(1, BUSHD_MOTORS_PER_MCU);
  std::vector<uint32_t> increments(count);
  for (uint32_t& increment : increments) increment = between<uint32_t>(0, most);
  increments[between<size_t>(0, count - 1)] = between<uint32_t>(1, most);
  return increments;
}

// The definition for more than two, in the printed function's own words: alpha, or all others.
size_t next_of(const std::vector<uint32_t>& increments, const std::vector<uint32_t>& made) {
  for (size_t i = 0; i < increments.size(); ++i) {
    if (increments[i] == 0) continue;
    int64_t others = 0;
    int64_t others_made = 0;
    for (size_t k = i + 1; k < increments.size(); ++k) {
      others += increments[k];
      others_made += made[k];
    }
    if (int64_t{increments[i]} * others_made - others * made[i] >= 0) return i;
  }
  return increments.size();
}

TEST(Elementary, OneCoordinateMakesAStepAtATimeOfAnyNumberOfThem) {
  holds("each step is that of the first coordinate that is not ahead of all behind it", [] {
    const std::vector<uint32_t> increments = any_increments(*rc::gen::element<uint32_t>(3, 60));
    bushd_elementary line = line_of(increments);
    std::vector<uint32_t> made(increments.size());
    for (uint32_t s = 0; s < line.sum; ++s) {
      const size_t expected = next_of(increments, made);
      RC_ASSERT(bushd_elementary_step(&line) == expected);
      ++made[expected];
      const auto step = static_cast<uint8_t>(expected);
      RC_ASSERT(bushd_elementary_run_step(&line, step, made[expected]) == s + 1);
      for (uint8_t i = 0; i < increments.size(); ++i) {
        RC_ASSERT(bushd_elementary_made(&line, i, s + 1) == made[i]);
      }
    }
    RC_ASSERT(made == increments);
  });
}

// Increments are as long as there may be.
TEST(Elementary, FindsAnyPlaceOfALongLine) {
  holds("a step is where it is found", [] {
    const bushd_elementary line = line_of(any_increments(134'217'727));
    const auto s = between<uint32_t>(0, line.sum - 1);
    unsigned coordinates = 0;
    for (uint8_t i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
      const uint32_t made = bushd_elementary_made(&line, i, s);
      if (bushd_elementary_made(&line, i, s + 1) == made) continue;
      ++coordinates;
      RC_ASSERT(bushd_elementary_run_step(&line, i, made + 1) == s + 1);
    }
    RC_ASSERT(coordinates == 1u);
  });
}

TEST(Elementary, PositionsRiseEvenlyFromStepToStep) {
  holds("position between two steps", [] {
    const std::vector<uint32_t> increments = any_increments(50);
    bushd_elementary line = line_of(increments);
    const auto i = between<uint8_t>(0, static_cast<uint8_t>(increments.size() - 1));
    RC_PRE(increments[i] > 0);
    uint64_t before = 0;
    for (uint32_t s = 0; s < line.sum; ++s) {
      RC_ASSERT(bushd_elementary_position(&line, i, s, 0) / 256 ==
                bushd_elementary_made(&line, i, s));
      for (unsigned fraction = 0; fraction < 256; fraction += 15) {
        const uint64_t at = bushd_elementary_position(&line, i, s, static_cast<uint8_t>(fraction));
        RC_ASSERT(at >= before);
        RC_ASSERT(at / 256 == bushd_elementary_made(&line, i, s));  // none within a step of the run
        before = at;
        if (line.coordinate[i].made == increments[i]) continue;
        RC_ASSERT(bushd_elementary_fraction(&line, i, static_cast<uint8_t>(fraction)) == at % 256);
      }
      bushd_elementary_step(&line);
    }
    RC_ASSERT(bushd_elementary_position(&line, i, line.sum, 0) == uint64_t{increments[i]} * 256);
  });
}

TEST(Elementary, StepsAreApartAndManyEnough) {
  holds("what a table for it is made by", [] {
    const std::vector<uint32_t> increments = any_increments(*rc::gen::element<uint32_t>(3, 40));
    const bushd_elementary line = line_of(increments);
    const auto i = between<uint8_t>(0, static_cast<uint8_t>(increments.size() - 1));
    RC_PRE(increments[i] > 0);
    const uint32_t apart = bushd_elementary_apart(&line, i);
    RC_ASSERT(apart >= 1u);
    for (uint32_t step = 1; step < increments[i]; ++step) {
      RC_ASSERT(bushd_elementary_run_step(&line, i, step + 1) -
                    bushd_elementary_run_step(&line, i, step) >=
                apart);
    }
    const uint32_t late = bushd_elementary_late(&line, i);
    for (uint32_t from = 0; from <= line.sum; ++from) {
      const uint32_t steps = between<uint32_t>(0, line.sum - from);
      const uint64_t share = uint64_t{steps} * increments[i] / line.sum;
      RC_ASSERT(bushd_elementary_made(&line, i, from + steps) -
                    bushd_elementary_made(&line, i, from) + late >=
                share);
    }
  });
}

}  // namespace
}  // namespace bushd::test::elementary_test
