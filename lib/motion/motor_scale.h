// What the numbers of a motor mean: steps and user units, where it may be, and how fast it may go.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "base/result.h"
#include "base/units/coordinates.h"
#include "engine/table.h"
#include "words/amount.h"

namespace bushd::motion {

class MotorScale {
 public:
  static constexpr std::int64_t kMaxPosition = units::Coordinates::kMaxSteps;

  // `max_speed`: user units/s.
  explicit MotorScale(units::Coordinates coordinates = {},
                      std::optional<units::SoftLimits> soft_limits = {},
                      std::optional<double> max_speed = {})
      : coordinates_(std::move(coordinates)), soft_limits_(soft_limits), max_speed_(max_speed) {}

  const units::Coordinates& coordinates() const { return coordinates_; }
  const std::optional<units::SoftLimits>& soft_limits() const { return soft_limits_; }
  const std::optional<double>& max_speed() const { return max_speed_; }
  void set_coordinates(units::Coordinates coordinates) { coordinates_ = std::move(coordinates); }
  void set_soft_limits(std::optional<units::SoftLimits> limits) { soft_limits_ = limits; }
  // For the motions that begin from now on.
  void set_max_speed(std::optional<double> speed) { max_speed_ = speed; }

  // An amount in steps. Errors: not finite, beyond what is counted.
  Result<std::int64_t> steps_of_position(const words::Amount& position) const;
  // Not rounded to a step.
  Result<units::Steps> position_of(const words::Amount& position) const;
  Result<units::Steps> distance_of(const words::Amount& distance) const;
  // The shortest delay, in units of `time_unit_ns`, of runs at max_speed and at this speed,
  // whichever is slower. Error: no speed, or one slower than any delay.
  Result<bushd_delay> shortest_delay_at(const std::optional<words::Speed>& speed,
                                        std::uint32_t time_unit_ns) const;

  // Where it may be, by its soft limits, or as far as positions are counted.
  std::int64_t lowest() const;
  std::int64_t highest() const;
  // Whether it may be moved there from `position`: one that stands beyond a limit, towards it.
  Result<void> may_move_to(std::int64_t target, std::int64_t position) const;
  // Error: how far it is from where it may be.
  Result<void> stands_within_soft_limits(std::int64_t position) const;

 private:
  Result<void> is_amount(const words::Amount& amount) const;
  std::string range_text() const;

  units::Coordinates coordinates_;
  std::optional<units::SoftLimits> soft_limits_;
  std::optional<double> max_speed_;
};

}  // namespace bushd::motion
