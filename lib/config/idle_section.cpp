#include "config/idle_section.h"

#include <fmt/format.h>

namespace bushd::config {

Result<void> read_idle(const tables::TomlReader& reader, Mcu* mcu) {
  constexpr double kLongestS = 1'000'000;
  if (reader.has("idle_disable_s")) {
    const std::string allowed = fmt::format("a number 0..{} s; 0: at once", kLongestS);
    const auto seconds = reader.number("idle_disable_s", allowed);
    if (!seconds) return fail(seconds.error());
    if (!(*seconds >= 0) || *seconds > kLongestS) {
      return fail(
          reader.error("idle_disable_s", fmt::format("is {}; allowed: {}", *seconds, allowed)));
    }
    mcu->idle_disable_s = *seconds;
  }
  if (!reader.has("enable_settle_ms")) return {};
  const auto settle = reader.integer("enable_settle_ms", 0, 60'000, "ms");
  if (!settle) return fail(settle.error());
  mcu->enable_settle_ms = static_cast<std::uint32_t>(*settle);
  return {};
}

}  // namespace bushd::config
