// A bound as text of few digits, for a refusal: what it tells is allowed itself.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>

namespace bushd {

// The number of six digits nearest to a bound (finite, above 0) and not beyond it.
inline std::string text_of_most(double most) {
  const std::string nearest = fmt::format("{:.6g}", most);
  const double told = std::strtod(nearest.c_str(), nullptr);
  if (told <= most) return nearest;
  return fmt::format("{:.6g}", told - std::pow(10, std::floor(std::log10(most)) - 5));
}
inline std::string text_of_least(double least) {
  const std::string nearest = fmt::format("{:.6g}", least);
  const double told = std::strtod(nearest.c_str(), nullptr);
  if (told >= least) return nearest;
  return fmt::format("{:.6g}", told + std::pow(10, std::floor(std::log10(least)) - 5));
}

}  // namespace bushd
