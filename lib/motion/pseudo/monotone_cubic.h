// A smooth curve through points that rises or falls all the way, without overshoot: cubic pieces
// with the slopes of F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace bushd::pseudo {

class MonotoneCubic {
 public:
  // Why there is no such curve, and at which point.
  struct Flaw {
    std::size_t point;
    std::string message;
  };
  // There must be two points or more, all finite; x rises strictly, y rises or falls strictly.
  static std::optional<Flaw> flaw(const std::vector<double>& x, const std::vector<double>& y);

  // Precondition: no flaw.
  MonotoneCubic(std::vector<double> x, std::vector<double> y);

  double first_x() const { return x_.front(); }
  double last_x() const { return x_.back(); }
  double first_y() const { return y_.front(); }
  double last_y() const { return y_.back(); }
  bool rises() const { return y_.back() > y_.front(); }

  // Beyond the first and the last point: their y.
  double at(double x) const;
  // The x with that y, to the accuracy of a double. Beyond the first and the last point: their x.
  double where(double y) const;

 private:
  double piece(std::size_t i, double t) const;

  std::vector<double> x_;
  std::vector<double> y_;
  std::vector<double> slope_;
};

}  // namespace bushd::pseudo
