// Whether motors can follow a trajectory (motion/trajectory.h), each by its own table.
//
// Judged are the steps as the motors' MCUs are told of them, each tick a straight piece. With A, D
// and c of the table, F = 1 / A(0), and rest also wherever the motor turns round:
//
//     every delay >= c, and >= the shortest delay of the motor's max_speed
//     delay j after rest >= A(j), j = 1, 2 ...; delay i before rest >= D(i), i = 0, 1 ..., where a
//     delay as long as A(0) and D(0) begins and ends a motion: as one of them while it is less
//     than twice as long, beyond that as rest
//     after a delay x, no shorter than what A has one index beyond the place of x
//     before a delay y, no shorter than what D has one index beyond the place of y
//
// where the place between two codes is by the squares of speeds, as of steady acceleration; and the
// same of the speed in each tick, as if the running step were made at it: a stop may come
// then. Of straight lines between rows, that each row is a corner that may be passed:
// |v2^2 - v1^2| <= F^2, and v1^2 + v2^2 <= F^2 where the motor turns round or begins; the last row
// may be passed faster, since the motor ramps down then. Two opposite steps around a turning point
// may be close together: they are no two steps of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/table.h"
#include "motion/trajectory.h"

namespace bushd::motion {

// The whole step that is nearest.
std::int64_t nearest_step(Trajectory::Position position);
// What a motor that is slow may be told in a tick so that it catches up: at half of F.
Trajectory::Position way_to_catch_up(const bushd_table& table, std::uint32_t tick_ns);
// The motor needs no ramp-down after the last row, which is there.
bool rests_at_end(const Trajectory& trajectory, std::size_t motor, const bushd_table& table);

class TrajectoryCheck {
 public:
  struct Motor {
    const bushd_table* table;  // outlives the check
    bushd_delay shortest_delay;
    std::int64_t lowest;  // steps where it may be
    std::int64_t highest;
  };
  enum class Fault { kPosition, kSpeed, kCorner, kSpeedUp, kSlowDown };
  // The first row, from 0, that is not reached as it should be, or not passed.
  struct Finding {
    std::size_t row;
    std::size_t motor;
    Fault fault;
    double asked_steps_per_s;
    double allowed_steps_per_s;
    std::int64_t steps;  // of kPosition: where it would go
  };

  // `trajectory` outlives the check, and may become longer meanwhile.
  TrajectoryCheck(const Trajectory& trajectory, std::vector<Motor> motors, std::uint32_t tick_ns);

  // Goes through some ticks of all motors. Returns false when all that is known has been looked
  // at.
  bool work(unsigned ticks);

  const std::optional<Finding>& first() const { return first_; }
  // By this much, in thousandths, times must be longer at least; 0: that is of no help.
  std::int64_t stretch_thousandths() const { return helps_ ? stretch_ : 0; }
  double peak_steps_per_s(std::size_t motor) const { return watched_[motor].peak; }

 private:
  struct Watched {
    Motor motor;
    Follower follower;
    bool runs = true;
    int direction = 0;
    std::int64_t last_tick = 0;  // of its last step, and where in it
    double last_ns = 0;
    std::vector<double> delays{};  // since rest, ns
    double peak = 0;
  };
  void look_at_rows();
  void look_at_row(std::size_t row, std::size_t motor);
  struct Point {
    double ns;  // in the tick
    Trajectory::Position at;
  };
  void follow(std::size_t motor);
  void follow_tick(std::size_t motor, Trajectory::Position before, Trajectory::Position at_before,
                   std::int64_t made, std::size_t row);
  std::int64_t step_between(std::size_t motor, std::int64_t next, Point from, Point to,
                            Trajectory::Position last);
  void look_at_ramp_down(std::size_t motor);
  void step(std::size_t motor, int direction, double ns);
  void judge(std::size_t motor, double delay_ns);
  void judge_speed(std::size_t motor);
  void rest(std::size_t motor, std::size_t index);
  void find(std::size_t row, std::size_t motor, Fault fault, double asked, double allowed,
            double stretch, std::int64_t steps = 0);

  const Trajectory& trajectory_;
  std::uint32_t tick_ns_;
  std::vector<Watched> watched_;
  std::size_t rows_seen_ = 0;
  std::optional<Finding> first_;
  bool helps_ = true;
  std::int64_t stretch_ = 1000;
};

}  // namespace bushd::motion
