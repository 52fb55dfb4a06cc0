// The load that the figures of docs/performance.md are measured on: constant-acceleration moves.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/run.h"
#include "engine/table.h"

namespace bushd::bench {

// A table of constant acceleration up to a top speed, with its index. Step i falls where v0 t + a
// t^2/2 = i; v0 is the speed that the motor starts at without a ramp.
class Table {
 public:
  Table(double steps_per_s2, double top_steps_per_s, uint32_t time_unit_ns,
        double start_steps_per_s = 0) {
    const double units_per_s = 1e9 / time_unit_ns;
    const double a = steps_per_s2;
    const double v0 = start_steps_per_s;
    const auto count = static_cast<size_t>((top_steps_per_s * top_steps_per_s - v0 * v0) / (2 * a));
    double made = 0;
    for (size_t i = 1; i <= count; ++i) {
      const double seconds = (std::sqrt(v0 * v0 + 2 * a * static_cast<double>(i)) - v0) / a;
      const double time = std::round(seconds * units_per_s);
      // Rounding of times, not of delays, so that no error adds up; kept from rising by one unit
      // here and there.
      const double delay = time - made;
      codes_.push_back(
          static_cast<uint16_t>(codes_.empty() ? delay : std::fmin(delay, codes_.back())));
      made += codes_.back();
    }
    view_.accel = {codes_.data(), static_cast<uint16_t>(codes_.size()), nullptr, nullptr, 0};
    view_.cruise = static_cast<uint16_t>(std::lround(units_per_s / top_steps_per_s));
    view_.time_unit_ns = time_unit_ns;
    sum_.resize(bushd_ramp_sum_entries(&view_.accel));
    bucket_.resize(bushd_ramp_bucket_entries(&view_.accel));
    bushd_ramp_index(&view_.accel, sum_.data(), bucket_.data());
    view_.decel = view_.accel;
  }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  const bushd_table* view() const { return &view_; }

 private:
  std::vector<uint16_t> codes_;
  std::vector<uint32_t> sum_;
  std::vector<uint32_t> bucket_;
  bushd_table view_{};
};

// 20000 steps/s^2 to about 10000 steps/s, a table and a top speed of its own for every motor.
class Moves {
 public:
  static constexpr uint32_t kTickNs = 1'000'000;
  static constexpr uint32_t kSteps = 20'000;

  explicit Moves(size_t motors) : runs_(motors) {
    for (size_t m = 0; m < motors; ++m) {
      tables_.push_back(
          std::make_unique<Table>(20'000.0, 10'000.0 - 25.0 * static_cast<double>(m), 200));
    }
  }

  // No faster than the shortest delay (engine/run.h), 0: as fast as the tables are.
  void start(uint16_t shortest_delay = 0) {
    for (size_t m = 0; m < runs_.size(); ++m) {
      bushd_run_start(&runs_[m], tables_[m]->view(), kSteps, m % 2 == 0 ? 1 : -1, shortest_delay);
    }
  }

  // The next ticks of all motors, tick-major as they go into packets; returns the motor-ticks in
  // which a motor moved.
  size_t expand_coarse(size_t ticks, uint8_t* out) {
    size_t active = 0;
    for (size_t m = 0; m < runs_.size(); ++m) {
      active += bushd_run_expand_coarse(&runs_[m], kTickNs, ticks, out + m, runs_.size());
    }
    return active;
  }
  size_t expand_fine(size_t ticks, int16_t* out) {
    size_t active = 0;
    for (size_t m = 0; m < runs_.size(); ++m) {
      active += bushd_run_expand_fine(&runs_[m], kTickNs, ticks, out + m, runs_.size());
    }
    return active;
  }

 private:
  std::vector<std::unique_ptr<Table>> tables_;
  std::vector<bushd_run> runs_;
};

}  // namespace bushd::bench
