#include "config/setting.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

namespace bushd::config {
namespace {

constexpr std::string_view kNone = "none";

// In the order of the enumeration.
constexpr std::array<std::string_view, kSettingKeys.size()> kKeyNames = {"offset", "direction",
                                                                         "soft_limits"};
constexpr std::array<std::string_view, kSettingKeys.size()> kAllowed = {
    "a number of user units", "negative, positive", "[LOWEST, HIGHEST] dial position, or none"};

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

std::optional<double> number_of(std::string_view text) {
  text = trimmed(text);
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

tl::unexpected<Error> refuse(SettingKey key, std::string_view text, std::string_view why = {}) {
  const std::string_view allowed = kAllowed.at(static_cast<std::size_t>(key));
  if (why.empty())
    return fail(fmt::format("{}: is \"{}\"; allowed: {}", name_of(key), text, allowed));
  return fail(fmt::format("{}: {}; allowed: {}", name_of(key), why, allowed));
}

std::optional<units::SoftLimits> limits_of(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('[') && text.ends_with(']') && text.size() > 1) {
    text = text.substr(1, text.size() - 2);
  }
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  const auto low = number_of(text.substr(0, comma));
  const auto high = number_of(text.substr(comma + 1));
  if (!low || !high) return std::nullopt;
  return units::SoftLimits{*low, *high};
}

Result<Settings> with_soft_limits(Settings settings, std::string_view text) {
  if (trimmed(text) == kNone) {
    settings.soft_limits.reset();
    return settings;
  }
  const auto limits = limits_of(text);
  if (!limits) return refuse(SettingKey::kSoftLimits, text);
  if (const auto good = check_soft_limits(settings.coordinates, *limits); !good) {
    return fail(std::string(name_of(SettingKey::kSoftLimits)) + ": " + good.error().message);
  }
  settings.soft_limits = limits;
  return settings;
}

}  // namespace

std::string_view name_of(SettingKey key) {
  return kKeyNames.at(static_cast<std::size_t>(key));
}

std::optional<SettingKey> setting_key_of(std::string_view name) {
  for (const SettingKey key : kSettingKeys) {
    if (name_of(key) == name) return key;
  }
  return std::nullopt;
}

bool applies(const Settings& settings, SettingKey key) {
  return key == SettingKey::kSoftLimits || settings.coordinates.has_unit();
}

std::string text_of(const Settings& settings, SettingKey key) {
  const units::Scale& scale = settings.coordinates.scale();
  switch (key) {
    case SettingKey::kOffset:
      return fmt::format("{}", scale.offset == 0 ? 0.0 : scale.offset);
    case SettingKey::kDirection:
      return scale.negative ? "negative" : "positive";
    case SettingKey::kSoftLimits:
      break;
  }
  if (!settings.soft_limits) return std::string(kNone);
  return fmt::format("[{}, {}]", settings.soft_limits->low, settings.soft_limits->high);
}

Result<Settings> with(Settings settings, SettingKey key, std::string_view text) {
  if (!applies(settings, key)) {
    return fail(fmt::format(
        "{}: it has no unit, so its positions are steps; give it `unit` and `steps_per_unit` in "
        "bushd.toml first",
        name_of(key)));
  }
  if (key == SettingKey::kSoftLimits) return with_soft_limits(std::move(settings), text);
  units::Scale scale = settings.coordinates.scale();
  if (key == SettingKey::kDirection) {
    const std::string_view word = trimmed(text);
    if (word != "positive" && word != "negative") return refuse(key, text);
    scale.negative = word == "negative";
  } else {
    const auto offset = number_of(text);
    if (!offset) return refuse(key, text);
    scale.offset = *offset;
  }
  auto coordinates = units::Coordinates::make(std::move(scale));
  if (!coordinates) return refuse(key, text, coordinates.error().message);
  settings.coordinates = std::move(*coordinates);
  return settings;
}

Result<void> check_soft_limits(const units::Coordinates& coordinates,
                               const units::SoftLimits& limits) {
  if (coordinates.first_step_from(limits.low) <= coordinates.last_step_to(limits.high)) return {};
  return fail(fmt::format("has no step from {} to {}; allowed: [lowest, highest] dial position",
                          limits.low, limits.high));
}

}  // namespace bushd::config
