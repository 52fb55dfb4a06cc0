#include "api/snapshot.h"

namespace bushd::api {

bool ToldScale::is_good() const {
  if (precision < 0 || precision > units::Coordinates::kMostDecimals) return false;
  if (soft_limits && !(std::isfinite(dial.low) && std::isfinite(dial.high))) return false;
  return units::parse_ratio(steps_per_unit) && units::Coordinates::make(scale());
}

units::Scale ToldScale::scale() const {
  return {.unit = unit,
          .steps_per_unit = units::parse_ratio(steps_per_unit).value_or(units::Ratio{}),
          .negative = negative,
          .offset = offset,
          .decimals = precision};
}

std::optional<units::SoftLimits> ToldScale::limits() const {
  return soft_limits ? std::optional(dial) : std::nullopt;
}

ToldScale told_scale(const units::Scale& scale, const std::optional<units::SoftLimits>& limits) {
  ToldScale told{.unit = scale.unit,
                 .steps_per_unit = to_text(scale.steps_per_unit),
                 .negative = scale.negative,
                 .offset = scale.offset,
                 .precision = static_cast<std::int8_t>(scale.decimals.value_or(0))};
  const auto coordinates = units::Coordinates::make(scale);
  if (!limits || !coordinates) return told;
  told.soft_limits = true;
  told.dial = *limits;
  told.user = coordinates->on_user_scale(*limits);
  return told;
}

}  // namespace bushd::api
