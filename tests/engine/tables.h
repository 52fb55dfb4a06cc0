// Tables for tests: a Law of the reference together with the engine's view of it, and a generator.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "engine/properties.h"
#include "engine/reference.h"
#include "engine/table.h"

namespace bushd::test {

// Owns what the engine's view points to; not movable once made.
class TestTable {
 public:
  TestTable(Law law, bool indexed) : law_(std::move(law)) {
    view_.accel = {law_.accel.data(), static_cast<uint16_t>(law_.accel.size()), nullptr, nullptr,
                   0};
    view_.decel = {law_.decel.data(), static_cast<uint16_t>(law_.decel.size()), nullptr, nullptr,
                   0};
    view_.cruise = law_.cruise;
    view_.time_unit_ns = law_.unit_ns;
    if (!indexed) return;
    index(view_.accel, arrays_[0], arrays_[1]);
    index(view_.decel, arrays_[2], arrays_[3]);
  }
  TestTable(const TestTable&) = delete;
  TestTable& operator=(const TestTable&) = delete;

  const bushd_table* view() const { return &view_; }
  const Law& law() const { return law_; }

 private:
  static void index(bushd_ramp& ramp, std::vector<uint32_t>& sum, std::vector<uint32_t>& bucket) {
    sum.resize(bushd_ramp_sum_entries(&ramp));
    bucket.resize(bushd_ramp_bucket_entries(&ramp));
    bushd_ramp_index(&ramp, sum.data(), bucket.data());
  }

  Law law_;
  bushd_table view_{};
  std::vector<uint32_t> arrays_[4];
};

inline std::vector<uint16_t> any_side() {
  // Short sides and narrow ranges make equal codes and shared borders likely.
  const auto count = *rc::gen::element<size_t>(1, 2, 3, 7, 40);
  const auto slowest = *rc::gen::element<uint16_t>(1, 3, 50, 2000, 65535);
  std::vector<uint16_t> side(count);
  for (auto& code : side) code = between<uint16_t>(1, std::max<uint16_t>(slowest, 2));
  std::sort(side.begin(), side.end(), std::greater<>());
  return side;
}

// Any table that passes bushd_table_check: one code, equal codes, sides that differ, cruise above,
// at and below the last codes, odd units.
inline Law any_law() {
  Law law;
  law.accel = any_side();
  law.decel = between(0, 2) == 0 ? law.accel : any_side();
  switch (between(0, 2)) {
    case 0:
      law.cruise = law.accel.back();
      break;
    case 1:
      law.cruise = between<uint16_t>(1, law.accel.back());
      break;
    default:
      law.cruise = between<uint16_t>(law.accel.back(), 65535);
      break;
  }
  law.unit_ns = *rc::gen::element<uint32_t>(1, 7, 100, 999, 40000, 123457, 5000000);
  return law;
}

// None, one of the table's delays, or another.
inline uint16_t any_shortest_delay(const Law& law) {
  switch (between(0, 4)) {
    case 0:
      return 0;
    case 1:
      return *rc::gen::elementOf(law.accel);
    case 2:
      return *rc::gen::elementOf(law.decel);
    case 3:
      return between<uint16_t>(1, 65535);
    default:
      return between<uint16_t>(law.decel.back(), law.decel.front());
  }
}

// That, or one beyond all codes, up to a step an hour.
inline uint64_t any_long_shortest_delay(const Law& law) {
  const uint64_t longest = BUSHD_LONGEST_DELAY_NS / law.unit_ns;
  if (longest <= UINT16_MAX || between(0, 1) != 0) return any_shortest_delay(law);
  const auto factor = *rc::gen::element<uint64_t>(1, 2, 100, 100'000, 100'000'000);
  return std::min(longest, (UINT16_MAX + between<uint64_t>(1, 70'000)) * factor);
}

// A tick of any length that lets no more than 127 steps fall into it, as the engine demands.
inline uint32_t any_tick_ns(const Law& law) {
  const uint64_t most = uint64_t{law.cruise} * law.unit_ns * 127 - 1;
  const auto upper = static_cast<uint32_t>(std::min<uint64_t>(most, 20'000'000));
  return between<uint32_t>(std::max<uint32_t>(1, upper / between<uint32_t>(1, 400)), upper);
}

}  // namespace bushd::test
