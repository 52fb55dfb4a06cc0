// The slow reference: a move straight from the formula, every step and every tick by itself, in
// exact rational arithmetic. Shares no code with the engine.
//
//   delay before step j of N  =  max( A(j-1), D(N-j), c )
//   step j at the sum of the first j delays
//   position at a tick's end  =  steps whose time is <= that end
//                                (fine: + floor(256 * elapsed / running delay) / 256)
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tables/table.h"

namespace bushd::test {

__extension__ typedef __int128 Wide;

class ReferenceMove {
 public:
  // `content` as in a table file: decel from fast to slow.
  ReferenceMove(const tables::TableContent& content, std::int64_t steps, std::uint64_t tick_ns)
      : unit_ns_(content.time_unit_ns), tick_ns_(tick_ns), positive_(steps >= 0) {
    const std::size_t count = static_cast<std::size_t>(steps < 0 ? -steps : steps);
    for (std::size_t j = 1; j <= count; ++j) delays_.push_back(delay(content, j, count));
    std::uint64_t time = 0;
    for (const std::uint64_t d : delays_) times_units_.push_back(time += d);
  }

  // Ticks until the last step is made, the one in which the move starts included.
  std::uint64_t active_ticks() const {
    if (times_units_.empty()) return 0;
    const Wide end_ns = Wide{times_units_.back()} * unit_ns_;
    return static_cast<std::uint64_t>((end_ns + tick_ns_ - 1) / tick_ns_);
  }

  std::vector<int> coarse() const {
    std::vector<int> out;
    std::int64_t before = 0;
    for (std::uint64_t tick = 0; tick < active_ticks(); ++tick) {
      const std::int64_t now = static_cast<std::int64_t>(steps_at(tick + 1));
      out.push_back(static_cast<int>(now - before) + (positive_ ? 128 : 0));
      before = now;
    }
    return out;
  }

  std::vector<int> fine() const {
    std::vector<int> out;
    std::int64_t before = 0;
    for (std::uint64_t tick = 0; tick < active_ticks(); ++tick) {
      const std::int64_t now = position_256(tick + 1);
      out.push_back(static_cast<int>(positive_ ? now - before : before - now));
      before = now;
    }
    return out;
  }

 private:
  static std::uint64_t delay(const tables::TableContent& content, std::size_t j, std::size_t n) {
    const std::vector<std::uint16_t>& accel = content.accel;
    const std::uint64_t c = content.cruise.value_or(accel.back());
    const auto A = [&](std::size_t i) { return i < accel.size() ? std::uint64_t{accel[i]} : c; };
    const auto D = [&](std::size_t i) {
      if (!content.decel) return A(i);
      const std::vector<std::uint16_t>& decel = *content.decel;
      return i < decel.size() ? std::uint64_t{decel[decel.size() - 1 - i]} : c;
    };
    return std::max({A(j - 1), D(n - j), c});
  }

  std::size_t steps_at(std::uint64_t tick_end) const {
    const Wide end_ns = Wide{tick_end} * tick_ns_;
    const auto later = std::find_if(times_units_.begin(), times_units_.end(),
                                    [&](std::uint64_t t) { return Wide{t} * unit_ns_ > end_ns; });
    return static_cast<std::size_t>(later - times_units_.begin());
  }

  std::int64_t position_256(std::uint64_t tick_end) const {
    const std::size_t steps = steps_at(tick_end);
    std::int64_t position = static_cast<std::int64_t>(steps) * 256;
    if (steps == delays_.size()) return position;
    const std::uint64_t last = steps == 0 ? 0 : times_units_[steps - 1];
    const Wide elapsed_ns = Wide{tick_end} * tick_ns_ - Wide{last} * unit_ns_;
    return position +
           static_cast<std::int64_t>(256 * elapsed_ns / (Wide{delays_[steps]} * unit_ns_));
  }

  Wide unit_ns_;
  Wide tick_ns_;
  bool positive_;
  std::vector<std::uint64_t> delays_;
  std::vector<std::uint64_t> times_units_;
};

}  // namespace bushd::test
