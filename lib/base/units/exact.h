// Private to lib/base/units: decimal texts as rational numbers.
#pragma once

#include <gmpxx.h>

#include <optional>
#include <string_view>

namespace bushd::units {

// The number that a text such as "-12", "0.1", ".5" or "2.5e-3" says. None: not such a text, or an
// exponent beyond +-400.
std::optional<mpq_class> exact(std::string_view text);

// What the shortest decimal text says that reads back as this number. None: not a finite number.
std::optional<mpq_class> exact(double number);

}  // namespace bushd::units
