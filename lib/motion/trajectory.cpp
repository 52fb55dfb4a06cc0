#include "motion/trajectory.h"

#include <algorithm>
#include <cmath>

#include "motion/trajectory_check.h"

namespace bushd::motion {
namespace {

using Position = Trajectory::Position;
using SignedWide = Trajectory::Segment::Wide;

// Binary places of u in a cubic.
constexpr int kShareBits = 40;

// More than that in a tick no table allows, and no MCU takes.
constexpr Position kMostInATick = 127 * Trajectory::kStep;

SignedWide shortest_delay_of(SignedWide numerator, SignedWide denominator) {
  const SignedWide quotient = numerator / denominator;
  return numerator % denominator < 0 ? quotient - 1 : quotient;
}

}  // namespace

void Trajectory::append(std::int64_t time_ns, std::span<const Position> positions) {
  time_ns_.push_back(time_ns);
  positions_.insert(positions_.end(), positions.begin(), positions.end());
}

std::size_t Trajectory::known_rows() const {
  const std::size_t waits = interpolation_ == Interpolation::kCubic && !closed_ ? 2 : 1;
  return rows() < waits ? 0 : rows() - waits;
}

double Trajectory::speed_after(std::size_t row, std::size_t motor) const {
  const double steps =
      std::ldexp(static_cast<double>(position(row + 1, motor) - position(row, motor)), -32);
  return steps * 1e9 / static_cast<double>(time_ns_[row + 1] - time_ns_[row]);
}

Trajectory Trajectory::stretched(std::int64_t thousandths) const {
  Trajectory longer = *this;
  for (std::int64_t& time_ns : longer.time_ns_) {
    time_ns = static_cast<std::int64_t>((SignedWide{time_ns} * thousandths + 500) / 1000);
  }
  return longer;
}

// Times `times_ns`. The parabola through three rows has at the middle one the mean of the speeds
// before and after it, each weighed by the time on the other side.
SignedWide Trajectory::speed_at(std::size_t row, std::size_t motor, std::int64_t times_ns) const {
  if (row == 0 || row + 1 == rows()) return 0;
  const SignedWide before_ns = time_ns_[row] - time_ns_[row - 1];
  const SignedWide after_ns = time_ns_[row + 1] - time_ns_[row];
  const SignedWide before = position(row, motor) - position(row - 1, motor);
  const SignedWide after = position(row + 1, motor) - position(row, motor);
  const SignedWide both_ns = before_ns + after_ns;
  return shortest_delay_of(before * times_ns / before_ns * after_ns, both_ns) +
         shortest_delay_of(after * times_ns / after_ns * before_ns, both_ns);
}

Trajectory::Segment Trajectory::segment(std::size_t row, std::size_t motor) const {
  Segment segment{.begin_ns = time_ns_[row],
                  .length_ns = time_ns_[row + 1] - time_ns_[row],
                  .begin = position(row, motor)};
  const SignedWide d = SignedWide{position(row + 1, motor)} - position(row, motor);
  if (interpolation_ == Interpolation::kLinear) {
    segment.k1 = d;
    return segment;
  }
  const SignedWide m0 = speed_at(row, motor, segment.length_ns);
  const SignedWide m1 = speed_at(row + 1, motor, segment.length_ns);
  segment.k1 = m0;
  segment.k2 = 3 * d - 2 * m0 - m1;
  segment.k3 = m0 + m1 - 2 * d;
  return segment;
}

Position Trajectory::Segment::at(std::int64_t time_ns) const {
  const SignedWide t = time_ns - begin_ns;
  if (k2 == 0 && k3 == 0)
    return begin + static_cast<Position>(shortest_delay_of(k1 * t, length_ns));
  const SignedWide u = (t << kShareBits) / length_ns;
  SignedWide sum = k3;
  for (const SignedWide k : {k2, k1, SignedWide{0}}) sum = ((sum * u) >> kShareBits) + k;
  return begin + static_cast<Position>(sum);
}

Follower::Follower(const Trajectory& trajectory, std::size_t motor, std::uint32_t tick_ns,
                   Position least)
    : trajectory_(&trajectory),
      motor_(motor),
      tick_ns_(tick_ns),
      least_(least),
      at_(trajectory.position(0, motor)) {
  made_ = nearest_step(at_);
  told_ = made_ * Trajectory::kStep;
  told_256_ = made_ * 256;
}

bool Follower::next(bool rests_at_end) {
  const std::int64_t end_ns = trajectory_->known_ns();
  const std::int64_t time_ns = (ticks_ + 1) * tick_ns_;
  const bool ends = trajectory_->closed() && rests_at_end;
  if (time_ns > end_ns && !ends) return false;
  const std::size_t rows = trajectory_->known_rows();
  while (row_ + 1 < rows && trajectory_->time_ns(row_ + 1) < time_ns) {
    ++row_;
    has_segment_ = false;
  }
  if (!has_segment_) segment_ = trajectory_->segment(row_, motor_);
  has_segment_ = true;
  const Position before = at_;
  over_ = ends && time_ns >= end_ns;
  at_ = over_ ? trajectory_->position(rows, motor_) : segment_.at(time_ns);
  ++ticks_;
  const Position way = at_ - before;
  const int direction_before = direction_;
  if (way != 0) direction_ = way > 0 ? 1 : -1;
  // Where it stands it may go on either way: in the middle it has as little to catch up in both.
  Position aim = way == 0 ? at_ : at_ + direction_ * (Trajectory::kStep / 2);
  if (ends && (over_ || row_ + 1 == rows)) {
    // It comes to rest on a whole step, and so goes no farther than that.
    const Position rest = nearest_step(trajectory_->position(rows, motor_)) * Trajectory::kStep;
    const bool straight = trajectory_->interpolation() == Trajectory::Interpolation::kLinear;
    if (over_) {
      aim = rest;
    } else if (straight && way != 0) {
      aim = direction_ > 0 ? std::min(aim, rest) : std::max(aim, rest);
    }
  }
  const Position most = std::min(std::max(2 * (way < 0 ? -way : way), least_), kMostInATick);
  Position told = std::clamp(aim - told_, -most, most);
  if (!over_ && way != 0 && told * direction_ < 0) told = 0;
  last_way_ = way * direction_;
  const std::int64_t made_before = made_;
  tell(told_ + told);
  const bool turned = direction_ != direction_before;
  if (turned || made_ != made_before) {
    fastest_before_ = turned ? 0 : fastest_now_;
    fastest_now_ = fastest_told_ = 0;
  }
  fastest_now_ = std::max(fastest_now_, last_way_);
  fastest_told_ = std::max(fastest_told_, told * direction_);
  return true;
}

// In 1/256 step, late rather than early; its MCU makes a step when it has been told a whole one.
void Follower::tell(Position told) {
  told_ = told;
  constexpr Position kPart = Trajectory::kStep / 256;
  told_256_ = direction_ < 0 ? -((-told_) >> 24) : told_ >> 24;
  static_assert(kPart == Position{1} << 24);
  while (told_256_ - made_ * 256 >= 256) ++made_;
  while (told_256_ - made_ * 256 <= -256) --made_;
}

}  // namespace bushd::motion
