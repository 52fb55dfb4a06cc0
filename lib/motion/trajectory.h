// Times and positions of several motors, row by row, and the motion through them: what motors
// follow in place of a run of a table.
//
// Positions count in 2^-32 of a step, times in ns from the first row. Between rows k and k + 1, h
// apart, t after the first of them, with d their difference, all rounded down:
//
//     linear   p + d t / h
//     cubic    p + u (k1 + u (k2 + u k3)),   u = t / h,   k1 = m0,  k2 = 3 d - 2 m0 - m1,
//              k3 = m0 + m1 - 2 d                                           (Hermite)
//
// where m0, m1 are h times the speeds at the rows: those of the parabola through the row and its
// two neighbours, 0 at the first row and at the last. So a row of a cubic is known to be passed
// only when the next one is there, or none follows.
//
// The motor makes a step where the position crosses the middle between two: it is within half a
// step of it. Where it begins or turns round, it goes twice as fast as the position until it has
// caught up with that: so the first step after a turn may be late by up to half a step of the way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace bushd::motion {

class Trajectory {
 public:
  using Position = std::int64_t;
  static constexpr Position kStep = Position{1} << 32;
  enum class Interpolation { kLinear, kCubic };

  // Precondition: motors >= 1.
  Trajectory(std::size_t motors, Interpolation interpolation)
      : motors_(motors), interpolation_(interpolation) {}

  // The next row. Precondition: not closed, one position per motor, later than the row before, and
  // the first at 0; the times of all are below 2^60 ns.
  void append(std::int64_t time_ns, std::span<const Position> positions);
  // No row follows. Precondition: two rows at least.
  void close() { closed_ = true; }

  std::size_t motors() const { return motors_; }
  Interpolation interpolation() const { return interpolation_; }
  std::size_t rows() const { return time_ns_.size(); }
  bool closed() const { return closed_; }
  std::int64_t time_ns(std::size_t row) const { return time_ns_[row]; }
  Position position(std::size_t row, std::size_t motor) const {
    return positions_[row * motors_ + motor];
  }
  // How far the motion is known, whatever rows follow: its last row. 0 while it is not known at
  // all.
  std::size_t known_rows() const;
  std::int64_t known_ns() const { return rows() == 0 ? 0 : time_ns_[known_rows()]; }

  // Mean speed from row `row` to the next, steps/s.
  double speed_after(std::size_t row, std::size_t motor) const;
  // With all times longer by this factor, in thousandths.
  Trajectory stretched(std::int64_t thousandths) const;

  // The motion between a row and the next.
  struct Segment {
    std::int64_t begin_ns = 0;
    std::int64_t length_ns = 0;
    Position begin = 0;
    __extension__ typedef __int128 Wide;
    Wide k1 = 0;
    Wide k2 = 0;
    Wide k3 = 0;
    Position at(std::int64_t time_ns) const;
  };
  // Precondition: row < known_rows().
  Segment segment(std::size_t row, std::size_t motor) const;

 private:
  Segment::Wide speed_at(std::size_t row, std::size_t motor, std::int64_t times_ns) const;

  std::size_t motors_;
  Interpolation interpolation_;
  bool closed_ = false;
  std::vector<std::int64_t> time_ns_;
  std::vector<Position> positions_;
};

// One motor on it, tick by tick from its first row on, where it stands on the nearest whole step.
// Copyable: a copy goes on as the original.
class Follower {
 public:
  using Position = Trajectory::Position;

  Follower() = default;
  // `trajectory` outlives it. `least`: what it may go in a tick where it is slow, to catch up.
  Follower(const Trajectory& trajectory, std::size_t motor, std::uint32_t tick_ns, Position least);

  // The next tick. Returns false, and does nothing, if that ends after what is known of the motion
  // and the motion is not closed, or does not end there slowly enough.
  // Precondition: !rests().
  bool next(bool rests_at_end);
  // The motion is over, and it stands on a whole step.
  bool rests() const { return over_ && told_ == made_ * Trajectory::kStep; }

  std::int64_t ticks() const { return ticks_; }
  // The row before where it is.
  std::size_t row() const { return row_; }
  // Where the motion is, and what its MCU is told, from step 0 on.
  Position at() const { return at_; }
  Position told() const { return told_; }
  std::int64_t told_256() const { return told_256_; }
  // Steps, as its MCU counts them by what it is told in 1/256 step.
  std::int64_t made() const { return made_; }
  int direction() const { return direction_; }
  // What it went in the last tick, in its direction; the most in any tick of the running step and
  // of the one before it; and the most that was told in one of the running step.
  Position last_way() const { return last_way_; }
  Position fastest_told() const { return fastest_told_; }
  Position fastest_way() const { return std::max(fastest_now_, fastest_before_); }

 private:
  void tell(Position told);

  const Trajectory* trajectory_ = nullptr;
  std::size_t motor_ = 0;
  std::uint32_t tick_ns_ = 1;
  Position least_ = 0;
  std::int64_t ticks_ = 0;
  std::size_t row_ = 0;
  Trajectory::Segment segment_{};
  bool has_segment_ = false;
  Position at_ = 0;
  Position told_ = 0;
  Position last_way_ = 0;
  Position fastest_now_ = 0;  // in the running step
  Position fastest_told_ = 0;
  Position fastest_before_ = 0;  // in the one before it
  std::int64_t told_256_ = 0;
  std::int64_t made_ = 0;
  int direction_ = 0;
  bool over_ = false;
};

}  // namespace bushd::motion
