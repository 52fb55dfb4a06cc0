#include "config/idle_section.h"

#include <fmt/format.h>

#include "config/words.h"

namespace bushd::config {

Result<void> read_idle(const tables::TomlReader& reader, Mcu* mcu) {
  constexpr double kLongestS = 1'000'000;
  const std::string allowed = fmt::format("a number 0..{} s; 0: at once", kLongestS);
  const auto check = [&](double seconds) -> Result<void> {
    if (seconds >= 0 && seconds <= kLongestS) return {};
    return fail(fmt::format("is {}; allowed: {}", seconds, allowed));
  };
  return Keys(reader)
      .number("idle_disable_s", &mcu->idle_disable_s, allowed, check)
      .whole("enable_settle_ms", &mcu->enable_settle_ms, 0, 60'000, "ms")
      .result();
}

}  // namespace bushd::config
