#include "base/units/ratio.h"

#include <fmt/format.h>

#include <cmath>

#include "base/units/exact.h"

namespace bushd::units {
namespace {

constexpr long kMostExponent = 400;  // a double's are within +-324

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// Takes the exponent behind `e`, off the end of `text`.
std::optional<long> take_exponent(std::string_view* text) {
  const std::size_t at = text->find_first_of("eE");
  if (at == std::string_view::npos) return 0;
  std::string_view digits = text->substr(at + 1);
  *text = text->substr(0, at);
  const bool negative = digits.starts_with('-');
  if (negative || digits.starts_with('+')) digits.remove_prefix(1);
  if (digits.empty()) return std::nullopt;
  long exponent = 0;
  for (const char c : digits) {
    if (!is_digit(c)) return std::nullopt;
    exponent = 10 * exponent + (c - '0');
    if (exponent > kMostExponent) return std::nullopt;
  }
  return negative ? -exponent : exponent;
}

Result<Ratio> make_ratio(const mpq_class& value) {
  if (value <= 0) return fail("is not above 0");
  const mpz_class& numerator = value.get_num();
  const mpz_class& denominator = value.get_den();
  if (!numerator.fits_slong_p() || !denominator.fits_slong_p()) {
    return fail("has too many digits: as a fraction in lowest terms it is " + value.get_str() +
                "; allowed: numbers below 2^63 there");
  }
  return Ratio{numerator.get_si(), denominator.get_si()};
}

}  // namespace

std::optional<mpq_class> exact(std::string_view text) {
  static_assert(sizeof(long) == sizeof(std::int64_t));
  constexpr std::size_t kMostDigits = 400;
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  auto exponent = take_exponent(&text);
  if (!exponent) return std::nullopt;
  std::string digits;
  bool point = false;
  for (const char c : text) {
    if (c == '.' && !point) {
      point = true;
    } else if (is_digit(c)) {
      digits += c;
      if (point) --*exponent;
    } else {
      return std::nullopt;
    }
  }
  if (digits.empty() || digits.size() > kMostDigits) return std::nullopt;
  mpz_class power;
  mpz_ui_pow_ui(power.get_mpz_t(), 10, static_cast<unsigned long>(std::labs(*exponent)));
  const mpz_class mantissa(digits, 10);
  mpq_class value(*exponent < 0 ? mpq_class(mantissa, power) : mpq_class(mantissa * power));
  value.canonicalize();
  return negative ? mpq_class(-value) : value;
}

std::optional<mpq_class> exact(double number) {
  if (!std::isfinite(number)) return std::nullopt;
  return exact(std::string_view(fmt::format("{}", number)));
}

Result<Ratio> parse_ratio(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto above = exact(text.substr(0, slash));
  const auto below = slash == std::string_view::npos ? mpq_class(1) : exact(text.substr(slash + 1));
  if (!above || !below) return fail("is no number and no ratio such as \"400/1.25\"");
  if (*below == 0) return fail("divides by 0");
  return make_ratio(*above / *below);
}

Result<Ratio> ratio_of(double number) {
  const auto value = exact(number);
  if (!value) return fail("is no finite number");
  return make_ratio(*value);
}

std::string to_text(const Ratio& ratio) {
  if (ratio.denominator == 1) return std::to_string(ratio.numerator);
  return fmt::format("{}/{}", ratio.numerator, ratio.denominator);
}

}  // namespace bushd::units
