// The profiles that are programs, against their sources' loops written down anew.
#include <gtest/gtest.h>

#include "tables/profiles/random_spec.h"

namespace bushd::test {
namespace {

using tables::profiles::make_content;
using tables::profiles::Profile;
using tables::profiles::Spec;

TEST(Recurrence, DivisorsAreThoseOfThePaper) {
  EXPECT_TRUE(rc::check("N_n = floor(f_ref / f_n), f_n = f_(n-1) + k T_(n-1)", [] {
    Spec spec = random_spec(Profile::kRecurrence);
    spec.published = true;
    spec.time_unit_ns = 1000;
    spec.start_hz = random_between(20, 2000);
    spec.max_hz = spec.start_hz * random_between(1.1, 10);
    spec.accel.acceleration = spec.max_hz * random_scale(0.5, 50);
    const auto content = make_content(spec);
    RC_ASSERT(content.has_value());
    const double f_ref = 1e6;
    double f = spec.start_hz;
    for (std::size_t n = 0; n + 1 < content->accel.size(); ++n) {
      RC_ASSERT(content->accel[n] == std::floor(f_ref / f + 1e-6));
      f += *spec.accel.acceleration * (1 / f);
    }
    RC_ASSERT(content->accel.back() == std::floor(f_ref / spec.max_hz + 1e-6));
  }));
}

TEST(Recurrence, RoundsUpUnlessToldOtherwise) {
  Spec spec{.name = "r", .start_hz = 300, .max_hz = 700};
  spec.accel = {.profile = Profile::kRecurrence, .acceleration = 2000};
  spec.time_unit_ns = 1'000'000;
  EXPECT_EQ(make_content(spec)->accel.front(), 4);
  spec.published = true;
  EXPECT_EQ(make_content(spec)->accel.front(), 3);
}

TEST(Recurrence, TimeAndCodesAskedForAreNotExceeded) {
  EXPECT_TRUE(rc::check("by the steepness k", [] {
    Spec spec = random_spec(Profile::kRecurrence);
    spec.accel.acceleration.reset();
    spec.accel.codes = *rc::gen::inRange(3U, 2000U);
    const auto delays = side_delays_s(spec, tables::profiles::Side::kAccel);
    RC_ASSERT(delays.has_value());
    RC_ASSERT(delays->size() <= *spec.accel.codes);
    RC_ASSERT(delays->size() + 1 >= *spec.accel.codes);
  }));
}

// The controller's loop, one turn for each interval of 25 us: timer, and every 625th the speed.
std::vector<int> avr_loop(long start, long maximum, long change, std::size_t count) {
  std::vector<int> delays;
  long speed = start;
  int timer = 0;
  int reload = static_cast<int>(2'560'000 / speed);
  for (long interval = 1; delays.size() < count; ++interval) {
    if (interval % 625 == 0) speed = std::min(maximum, speed + change);
    if (++timer < reload) continue;
    delays.push_back(reload);
    timer = 0;
    reload = static_cast<int>(2'560'000 / speed);
  }
  return delays;
}

// n1 = 3, n3 = 2, dp = 3: bytes of the document, in the order of the motion.
TEST(Serial, SpeedChangesByTheDocumentsDifferencesAfterEachByte) {
  Spec spec{.name = "s", .start_hz = 100, .max_hz = 400};
  spec.time_unit_ns = 1000;
  spec.accel = {.profile = Profile::kSerial, .codes = 15};
  spec.decel = tables::profiles::SideSpec{.profile = Profile::kSerial, .codes = 13};
  const auto content = make_content(spec);
  ASSERT_TRUE(content) << content.error().message;
  const auto codes = [](std::initializer_list<std::pair<int, double>> bytes) {
    std::vector<std::uint16_t> all;
    for (const auto& [steps, hz] : bytes) {
      all.insert(all.end(), static_cast<std::size_t>(steps),
                 static_cast<std::uint16_t>(std::ceil(1e6 / hz)));
    }
    return all;
  };
  EXPECT_EQ(content->accel, codes({{5, 100}, {5, 200}, {5, 300}, {1, 400}}));
  EXPECT_EQ(content->decel, codes({{1, 400}, {5, 300}, {5, 200}, {3, 100}}));
}

TEST(Serial, RefusesStepsThatAreNoBytes) {
  Spec spec{.name = "s", .start_hz = 100, .max_hz = 400};
  spec.accel = {.profile = Profile::kSerial, .codes = 16};
  EXPECT_NE(make_content(spec).error().message.find("multiples of 5"), std::string::npos);
  spec.accel.codes = 15;
  spec.decel = tables::profiles::SideSpec{.profile = Profile::kSerial, .codes = 15};
  EXPECT_NE(make_content(spec).error().message.find("all but multiples of 5"), std::string::npos);
  spec.accel = {.profile = Profile::kSerial, .time_s = 1};
  EXPECT_NE(make_content(spec).error().message.find("takes --codes"), std::string::npos);
}

TEST(V64, DelaysAreThoseOfTheControllersLoop) {
  EXPECT_TRUE(rc::check("64 updates a second, T = 2560000 / VC", [] {
    Spec spec{.name = "v"};
    const long start = *rc::gen::inRange(64, 64 * 200);
    const long maximum = start + *rc::gen::inRange(1, 64 * 3000);
    const long change = *rc::gen::inRange(100, 20000);
    spec.start_hz = static_cast<double>(start) / 64;
    spec.max_hz = static_cast<double>(maximum) / 64;
    spec.accel = {.profile = Profile::kV64, .acceleration = static_cast<double>(change)};
    spec.published = true;
    const auto content = make_content(spec);
    RC_ASSERT(content.has_value());
    RC_ASSERT(content->time_unit_ns == 25'000U);
    const auto expected = avr_loop(start, maximum, change, content->accel.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      RC_ASSERT(int{content->accel[i]} == expected[i]);
    }
  }));
}

TEST(V64, NeverFasterThanTheMaximumUnlessAsPublished) {
  Spec spec{.name = "v", .start_hz = 50, .max_hz = 3000};
  spec.accel = {.profile = Profile::kV64, .acceleration = 8000};
  EXPECT_EQ(make_content(spec)->accel.back(), 14);  // 350 us: 2857 steps/s
  spec.published = true;
  EXPECT_EQ(make_content(spec)->accel.back(), 13);  // 325 us: 3077 steps/s
}

TEST(V64, HasATimeUnitOfItsOwn) {
  Spec spec{.name = "v", .start_hz = 50, .max_hz = 3000, .time_unit_ns = 1000};
  spec.accel = {.profile = Profile::kV64, .acceleration = 8000};
  EXPECT_NE(make_content(spec).error().message.find("25us"), std::string::npos);
}

}  // namespace
}  // namespace bushd::test
