// What users call positions, by arithmetic of its own. All numbers are millionths of a unit, and
// the scales are such that a step is a whole number of them: so everything is exact in integers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/snapshot.h"
#include "config/config.h"
#include "request.h"

namespace bushfaults {

// Most motors get a unit, of all kinds; half of these soft limits.
void add_units(bushd::config::Config& config, std::uint64_t seed);

class Units {
 public:
  // `config` outlives it.
  explicit Units(const bushd::config::Config& config);

  // Its offsets may have been kept, and may not: what a state shows first decides.
  void daemon_started(bool kept);
  // A user position was set where the motor stood, if that is known.
  void was_set(std::size_t motor, std::int64_t user_micro, std::optional<std::int64_t> stands);

  bool has_unit(std::size_t motor) const { return motors_[motor].unit; }
  // Nothing: the offset is not known.
  std::optional<std::int64_t> steps_of_position(std::size_t motor, std::int64_t user_micro) const;
  std::optional<std::int64_t> user_of(std::size_t motor, std::int64_t steps) const;
  std::int64_t steps_of_dial(std::size_t motor, std::int64_t dial_micro) const;
  std::int64_t steps_of_distance(std::size_t motor, std::int64_t user_micro) const;
  std::int64_t micro_of_distance(std::size_t motor, std::int64_t steps) const;

  struct Limits {
    std::int64_t low;
    std::int64_t high;
  };
  std::optional<Limits> limits(std::size_t motor) const { return motors_[motor].limits; }
  // No delay of such a request is shorter, in nanoseconds.
  std::int64_t floor_ns(std::size_t motor, const Request& request) const;

  // What is wrong with the numbers for users, if something is.
  std::optional<std::string> check(std::size_t motor, const bushd::api::MotorState& state);

 private:
  struct Motor {
    bool unit = false;
    std::int64_t micro_per_step = 1'000'000;
    int sign = 1;
    std::optional<std::int64_t> offset = 0;
    std::int64_t offset_in_file = 0;
    std::vector<std::int64_t> offsets{};  // that may have been kept; none: any
    std::optional<Limits> limits{};
  };
  const bushd::config::Config& config_;
  std::vector<Motor> motors_;
};

}  // namespace bushfaults
