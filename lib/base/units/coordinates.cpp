#include "base/units/coordinates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "base/bound_text.h"
#include "base/units/exact.h"

namespace bushd::units {
namespace {

constexpr long kLongestDelayNs = 3'600'000'000'000;  // as of the engine (engine/table.h)

// What is shown is within two units in the last place of a double of the exact position: its own
// rounding, and where long double is no wider than double those of quotient and sum. 2^50 steps of
// offset and 2^31 of position leave this below a quarter of a step.
constexpr std::int64_t kMostOffsetSteps = std::int64_t{1} << 50;

mpq_class as_mpq(const Ratio& ratio) {
  return {mpz_class(static_cast<long>(ratio.numerator)),
          mpz_class(static_cast<long>(ratio.denominator))};
}

mpz_class floor_of(const mpq_class& value) {
  mpz_class out;
  mpz_fdiv_q(out.get_mpz_t(), value.get_num_mpz_t(), value.get_den_mpz_t());
  return out;
}

mpz_class nearest(const mpq_class& value) {
  const mpz_class magnitude = floor_of(abs(value) + mpq_class(1, 2));
  return sgn(value) < 0 ? mpz_class(-magnitude) : magnitude;
}

Result<std::int64_t> steps_from(const mpq_class& exact_steps) {
  const mpz_class steps = nearest(exact_steps);
  if (abs(steps) > Coordinates::kMaxSteps) {
    return fail(fmt::format("is {:.6g} steps; positions lie within +-{} steps", steps.get_d(),
                            Coordinates::kMaxSteps));
  }
  return steps.get_si();
}

Result<mpq_class> number(double value) {
  auto out = exact(value);
  if (!out) return fail("is no finite number");
  return *out;
}

constexpr std::int64_t kPartsPerStep = std::int64_t{1} << 32;

Result<Steps> unrounded_from(const mpq_class& exact_steps) {
  const auto whole = steps_from(exact_steps);
  if (!whole) return fail(whole.error());
  const mpq_class beyond = exact_steps - mpq_class(static_cast<long>(*whole));
  return Steps{*whole, nearest(beyond * mpq_class(static_cast<long>(kPartsPerStep))).get_si()};
}

std::int64_t clamped(const mpz_class& steps) {
  if (steps > Coordinates::kMaxSteps) return Coordinates::kMaxSteps;
  if (steps < -Coordinates::kMaxSteps) return -Coordinates::kMaxSteps;
  return steps.get_si();
}

// The decimal number that a double stands for, with the digits that a long double has beyond.
long double widened(double value) {
  return std::strtold(fmt::format("{}", value).c_str(), nullptr);
}

long double dial(const Ratio& steps_per_unit, std::int64_t steps) {
  return static_cast<long double>(steps) * static_cast<long double>(steps_per_unit.denominator) /
         static_cast<long double>(steps_per_unit.numerator);
}

double user_position(const Scale& scale, long double dial) {
  const long double offset = scale.offset == 0 ? 0 : widened(scale.offset);
  return static_cast<double>(scale.negative ? offset - dial : offset + dial);
}

Result<mpq_class> exact_steps_of_user(const Scale& scale, double user) {
  const auto value = number(user);
  if (!value) return fail(value.error());
  mpq_class dial = *value - *exact(scale.offset);
  if (scale.negative) dial = -dial;
  return mpq_class(dial * as_mpq(scale.steps_per_unit));
}

}  // namespace

Steps operator+(const Steps& a, const Steps& b) {
  Steps sum{a.whole + b.whole, a.parts + b.parts};
  if (sum.parts > kPartsPerStep / 2) {
    sum.whole += 1;
    sum.parts -= kPartsPerStep;
  } else if (sum.parts < -kPartsPerStep / 2) {
    sum.whole -= 1;
    sum.parts += kPartsPerStep;
  }
  return sum;
}

Result<Coordinates> Coordinates::make(Scale scale) {
  const auto offset = number(scale.offset);
  if (!offset) return fail("the offset " + offset.error().message);
  if (abs(*offset * as_mpq(scale.steps_per_unit)) > mpq_class(kMostOffsetSteps)) {
    return fail(
        fmt::format("an offset of {} {} is more than 2^50 steps, and steps could not be "
                    "told apart there",
                    scale.offset, scale.unit));
  }
  Coordinates out;
  out.scale_ = std::move(scale);
  return out;
}

int Coordinates::precision() const {
  if (scale_.decimals) return *scale_.decimals;
  const Ratio& ratio = scale_.steps_per_unit;
  if (ratio.denominator == 1 && ratio.numerator == 1) return 0;
  const double per_unit =
      static_cast<double>(ratio.numerator) / static_cast<double>(ratio.denominator);
  return std::clamp(static_cast<int>(std::floor(std::log10(per_unit))) + 2, 0, kMostDecimals);
}

std::string Coordinates::text(std::int64_t steps) const {
  return fmt::format("{:.{}f} {}", user_of(steps), precision(), scale_.unit);
}

double Coordinates::dial_of(std::int64_t steps) const {
  return static_cast<double>(dial(scale_.steps_per_unit, steps));
}

double Coordinates::user_of(std::int64_t steps) const {
  return user_position(scale_, dial(scale_.steps_per_unit, steps));
}

double Coordinates::user_of(const Steps& steps) const {
  const long double beyond = static_cast<long double>(steps.parts) / kPartsPerStep;
  return user_position(
      scale_, dial(scale_.steps_per_unit, steps.whole) + beyond * dial(scale_.steps_per_unit, 1));
}

SoftLimits Coordinates::on_user_scale(const SoftLimits& dial) const {
  const double low = user_position(scale_, widened(dial.low));
  const double high = user_position(scale_, widened(dial.high));
  return scale_.negative ? SoftLimits{high, low} : SoftLimits{low, high};
}

Result<std::int64_t> Coordinates::steps_of_dial(double dial) const {
  const auto value = number(dial);
  if (!value) return fail(value.error());
  return steps_from(*value * as_mpq(scale_.steps_per_unit));
}

Result<std::int64_t> Coordinates::steps_of_user(double user) const {
  const auto steps = exact_steps_of_user(scale_, user);
  if (!steps) return fail(steps.error());
  return steps_from(*steps);
}

Result<Steps> Coordinates::unrounded_of_user(double user) const {
  const auto steps = exact_steps_of_user(scale_, user);
  if (!steps) return fail(steps.error());
  return unrounded_from(*steps);
}

Result<Steps> Coordinates::unrounded_of_distance(double user_units) const {
  const auto value = number(user_units);
  if (!value) return fail(value.error());
  return unrounded_from((scale_.negative ? -*value : *value) * as_mpq(scale_.steps_per_unit));
}

Result<std::int64_t> Coordinates::parts_of_user(double user) const {
  const auto steps = exact_steps_of_user(scale_, user);
  if (!steps) return fail(steps.error());
  if (const auto whole = steps_from(*steps); !whole) return whole;
  return nearest(*steps * mpq_class(std::int64_t{1} << 32)).get_si();
}

Result<std::int64_t> Coordinates::steps_of_distance(double user_units) const {
  const auto steps = steps_of_dial(user_units);
  if (!steps) return steps;
  return scale_.negative ? -*steps : *steps;
}

Result<std::uint64_t> Coordinates::delay_at(double user_units_per_s, std::uint32_t unit_ns) const {
  const auto speed = number(user_units_per_s);
  if (!speed || *speed <= 0) {
    return fail(fmt::format("a speed of {}; allowed: any above 0", user_units_per_s));
  }
  const mpq_class delay_ns = mpq_class(1'000'000'000) / (*speed * as_mpq(scale_.steps_per_unit));
  if (delay_ns <= kLongestDelayNs) {
    return mpz_class(-floor_of(-(delay_ns / mpq_class(unit_ns)))).get_ui();
  }
  const mpq_class slowest = *speed * delay_ns / kLongestDelayNs;
  return fail(fmt::format(
      "{} {}/s would take {:.6g} s a step; allowed: up to an hour a step, which is {} {}/s",
      user_units_per_s, scale_.unit, delay_ns.get_d() * 1e-9, text_of_least(slowest.get_d()),
      scale_.unit));
}

std::int64_t Coordinates::first_step_from(double dial) const {
  const mpq_class steps = *exact(dial) * as_mpq(scale_.steps_per_unit);
  return clamped(-floor_of(-steps));
}

std::int64_t Coordinates::last_step_to(double dial) const {
  return clamped(floor_of(*exact(dial) * as_mpq(scale_.steps_per_unit)));
}

Result<Coordinates> Coordinates::with_user(double user, std::int64_t steps) const {
  if (!std::isfinite(user)) return fail("is no finite number");
  const long double at = dial(scale_.steps_per_unit, steps);
  Scale scale = scale_;
  scale.offset = static_cast<double>(scale_.negative ? widened(user) + at : widened(user) - at);
  return make(std::move(scale));
}

}  // namespace bushd::units
