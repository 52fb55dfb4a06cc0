#include "tables/profiles/quantity.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace bushd::tables::profiles {
namespace {

struct Unit {
  std::string_view name;
  double factor;
};

std::vector<Unit> units_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kSpeed:
      return {{"steps/s", 1}, {"Hz", 1}, {"kHz", 1e3}};
    case Quantity::kAcceleration:
      return {{"steps/s2", 1}, {"Hz/s", 1}, {"kHz/s", 1e3}};
    case Quantity::kJerk:
      return {{"steps/s3", 1}, {"Hz/s2", 1}, {"kHz/s2", 1e3}};
    case Quantity::kTime:
      return {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
    case Quantity::kTimeUnit:
      return {{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}};
    case Quantity::kTorque:
      return {{"Nm", 1}, {"Ncm", 1e-2}, {"mNm", 1e-3}};
    case Quantity::kInertia:
      return {{"kg m2", 1}, {"g cm2", 1e-7}, {"kg cm2", 1e-4}};
  }
  return {};
}

bool needs_unit(Quantity quantity) {
  return quantity == Quantity::kTorque || quantity == Quantity::kInertia;
}

std::string without_blanks(std::string_view text) {
  std::string out(text);
  std::erase(out, ' ');
  return out;
}

}  // namespace

std::string units_text(Quantity quantity) {
  std::string names;
  for (const Unit& unit : units_of(quantity)) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
  }
  return names;
}

Result<double> parse_quantity(Quantity quantity, std::string_view text) {
  const std::string copy(text);
  char* end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  std::string_view rest(end);
  while (rest.starts_with(' ')) rest.remove_prefix(1);
  const auto units = units_of(quantity);
  const bool starts_as_number =
      !copy.empty() && std::string_view("+-.0123456789").find(copy[0]) != std::string_view::npos;
  if (starts_as_number && end != copy.c_str() && std::isfinite(value)) {
    if (rest.empty() && !needs_unit(quantity)) return value;
    for (const Unit& unit : units) {
      if (!rest.ends_with(' ') && without_blanks(rest) == without_blanks(unit.name)) {
        return value * unit.factor;
      }
    }
  }
  const std::string none =
      needs_unit(quantity) ? "" : fmt::format(" (none: {})", units.front().name);
  return fail(fmt::format("\"{}\"; allowed: a number with one of the units {}{}",
                          copy.substr(0, 40), units_text(quantity), none));
}

}  // namespace bushd::tables::profiles
