// Exact numbers: what a person has written, digit for digit.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bushd::units {

// In lowest terms, above 0.
struct Ratio {
  std::int64_t numerator = 1;
  std::int64_t denominator = 1;
  friend bool operator==(const Ratio&, const Ratio&) = default;
};

// The ratio that a text such as "400", "0.1", "2.5e-3" or "400/1.25" says. Errors: not such a text;
// not above 0; numerator or denominator in lowest terms beyond 2^63 - 1.
Result<Ratio> parse_ratio(std::string_view text);

// What the shortest decimal text says that reads back as this number: 0.1 is one tenth. Errors as
// above.
Result<Ratio> ratio_of(double number);

// "400", "2/5".
std::string to_text(const Ratio& ratio);

}  // namespace bushd::units
