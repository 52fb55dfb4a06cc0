// Random monotone tables with a tick that they are slow enough for: symmetric or not, cruise slower
// or faster than the ends of the sides, units that do not divide the tick.
#pragma once

#include <rapidcheck.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/run.h"
#include "tables/table.h"

namespace bushd::test {

struct RandomCase {
  tables::TableContent content;
  std::uint32_t tick_ns = 0;
};

inline int random_in(int low, int high) {
  return *rc::gen::inRange(low, high + 1);
}

// Falling codes between `fastest` and a random multiple of it; plateaus are likely when that is
// small.
inline std::vector<std::uint16_t> random_side(int fastest) {
  const int slowest = std::min(65535, fastest + random_in(0, fastest * random_in(1, 30)));
  const int count = random_in(1, random_in(0, 3) == 0 ? 2 : 60);
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < count; ++i) {
    codes.push_back(static_cast<std::uint16_t>(random_in(fastest, slowest)));
  }
  std::sort(codes.begin(), codes.end(), std::greater<>());
  return codes;
}

// `tick_step_ns`: ticks are multiples of it.
inline RandomCase random_case(std::uint32_t tick_step_ns) {
  RandomCase made;
  const int step = static_cast<int>(tick_step_ns);
  made.tick_ns =
      tick_step_ns * static_cast<std::uint32_t>(random_in(200'000 / step, 20'000'000 / step));
  const int fastest = random_in(1, random_in(0, 1) == 0 ? 12 : 2000);
  tables::TableContent& content = made.content;
  content.name = "random";
  content.accel = random_side(fastest);
  if (random_in(0, 1) == 0) {
    content.decel = random_side(fastest);
    std::reverse(content.decel->begin(), content.decel->end());
  }
  if (random_in(0, 2) != 0) {
    content.cruise =
        static_cast<std::uint16_t>(random_in(1, std::min(65535, 3 * content.accel.back())));
  }
  // The shortest delay is between the fastest that the tick allows and a few ticks.
  const std::int64_t shortest = content.cruise.value_or(content.accel.back());
  const std::int64_t least_ns = made.tick_ns / (BUSHD_MAX_STEPS_PER_TICK - 1) + 1;
  const std::int64_t delay_ns =
      random_in(0, 1) == 0
          ? least_ns
          : random_in(static_cast<int>(least_ns), 2 * static_cast<int>(made.tick_ns));
  content.time_unit_ns = static_cast<std::uint32_t>((delay_ns + shortest - 1) / shortest);
  return made;
}

// What a table file with this content looks like.
inline std::string file_text(const tables::TableContent& content) {
  const auto codes = [](const std::vector<std::uint16_t>& side) {
    std::string text;
    for (const std::uint16_t code : side) text += std::to_string(code) + ", ";
    return "[" + text + "]\n";
  };
  std::string text = "name = \"" + content.name + "\"\n";
  text += "time_unit_ns = " + std::to_string(content.time_unit_ns) + "\n";
  text += "accel = " + codes(content.accel);
  if (content.decel) text += "decel = " + codes(*content.decel);
  if (content.cruise) text += "cruise = " + std::to_string(*content.cruise) + "\n";
  return text;
}

}  // namespace bushd::test
