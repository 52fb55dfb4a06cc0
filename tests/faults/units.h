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
// Half of the motors get backlash, some of these a speed of the last approach; some settle.
void add_backlash(bushd::config::Config& config, std::uint64_t seed);

class Units {
 public:
  // `config` outlives it.
  explicit Units(const bushd::config::Config& config);

  // What was set in operation may have been kept, and may not: what is said first decides.
  void daemon_started(bool kept);
  // A user position was set where the motor stood, if that is known.
  void was_set(std::size_t motor, std::int64_t user_micro, std::optional<std::int64_t> stands);
  // In operation; which change of the motor's it is. From then on no older one is to be seen once
  // the disk has it.
  std::uint64_t configured(std::size_t motor, const Setting& setting);
  void is_on_disk(std::size_t motor, std::uint64_t change);

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
  std::optional<Limits> limits(std::size_t motor) const;
  // No delay of such a request is shorter, in nanoseconds.
  std::int64_t shortest_delay_ns(std::size_t motor, const Request& request) const;

  // Signed, in steps: where the last approach of a move comes from; 0: from either side.
  std::int64_t backlash_steps(std::size_t motor) const;
  // It is no faster than that, and slower than the move that was asked for.
  bool approach_is_slower(std::size_t motor, const Request& request) const;
  std::int64_t approach_shortest_delay_ns(std::size_t motor, const Request& request) const;

  // What is wrong with the numbers for users, if something is.
  std::optional<std::string> check(std::size_t motor, const bushd::api::MotorState& state);
  // With what is said of its scale and limits.
  std::optional<std::string> check(std::size_t motor, const bushd::api::MotorDescription& said);

 private:
  struct Settings {
    std::optional<std::int64_t> offset = 0;  // nothing: any
    int sign = 1;
    // On the dial.
    std::optional<std::int64_t> low{};
    std::optional<std::int64_t> high{};
    std::uint64_t change = 0;
    bool is(const Settings& said) const {
      return (!offset || offset == said.offset) && sign == said.sign && low == said.low &&
             high == said.high;
    }
  };
  struct Motor {
    bool unit = false;
    std::int64_t micro_per_step = 1'000'000;
    Settings in_file{};
    Settings now{};
    bool decided = true;           // it is `now`, not any of `kept`
    std::vector<Settings> kept{};  // that a daemon that starts may find
    std::int64_t backlash_micro = 0;
    std::int64_t approach_micro = 0;  // a second; 0: no slower
  };
  void change(Motor& motor, Settings settings);
  // The delay of a step, in units of time, rounded up.
  std::int64_t delay(std::size_t motor, std::int64_t speed_micro,
                     std::int64_t micro_per_step) const;
  std::int64_t delay(std::size_t motor, const Request& request) const;
  std::int64_t unit_ns(std::size_t motor) const;

  const bushd::config::Config& config_;
  std::vector<Motor> motors_;
  std::uint64_t changes_ = 0;
};

}  // namespace bushfaults
