// A straight way of several motors: from where to where, by which table, how fast, and where each
// of them is on it. The runs on it are those of their axes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "motion/axis.h"
#include "tables/envelope.h"

namespace bushd::motion {

class Way {
 public:
  struct Motor {
    const bushd_table* table;  // outlives the way
    std::int64_t from;
    std::int64_t to;  // |to - from| < 2^31
    bushd_delay shortest_delay;
    std::uint8_t output = 0;  // of its MCU; by the elementary law all are of one
  };
  enum class Law {
    kLeading,    // the motor with most steps leads, others step with it (engine/line.h)
    kElementary  // one step of one motor at a time (engine/elementary.h)
  };
  Way() = default;
  // At least one motor. Precondition of the elementary law: the ways of all are below 2^31
  // together.
  explicit Way(std::vector<Motor> motors, Law law = Law::kLeading);

  // A number for logs, which its shares have too.
  void set_number(std::uint64_t number) { number_ = number; }

  const std::vector<Motor>& motors() const { return motors_; }
  std::uint32_t increment(std::size_t motor) const;
  bool is_elementary() const { return elementary_ != nullptr; }
  // Steps of its runs: those of the motor with most of them, or by the elementary law of all; 0:
  // none moves, and all else says nothing.
  std::uint32_t longest() const { return longest_; }
  bushd_delay shortest_delay() const { return shortest_delay_; }  // of its runs
  const std::shared_ptr<const tables::Envelope>& table() const { return table_; }
  // By whose table it takes so long.
  std::size_t limiting() const { return limiting_; }
  double duration_ns() const { return duration_ns(shortest_delay_); }
  double most_steps_per_s(std::size_t motor) const;
  // Where a motor is when the way's run has made so many steps of it.
  std::int64_t position_at(std::size_t motor, std::uint32_t step) const;
  // A motor's share of a run between these steps of the way.
  LineShare share(std::size_t motor, std::uint32_t from, std::uint32_t to) const;

  // Other shortest delays of the motors.
  void set_shortest_delays(std::span<const bushd_delay> shortest_delays);
  // No step of its runs is shorter than this, at most BUSHD_LONGEST_DELAY_NS. `under_way`: its
  // table stays as it is.
  void slow_down_to(double step_ns, bool under_way = false);
  // A delay in time units, rounded up.
  static bushd_delay units_of(double step_ns, std::uint32_t unit_ns);
  // Takes at least this long, and not much longer. Errors: more or less than what is possible.
  Result<void> take(double duration_s, double longest_ns);

 private:
  std::vector<tables::LinePart> parts() const;
  double duration_ns(bushd_delay shortest_delay) const;
  void make_slower(double step_ns);

  std::vector<Motor> motors_;
  std::uint64_t number_ = 0;
  std::uint32_t longest_ = 0;
  std::shared_ptr<const bushd_elementary> elementary_;  // none: by the other law
  std::shared_ptr<const tables::Envelope> table_;
  std::shared_ptr<RunBlocks> blocks_ = std::make_shared<RunBlocks>();
  bushd_delay shortest_delay_ = 0;
  std::size_t limiting_ = 0;
};

}  // namespace bushd::motion
