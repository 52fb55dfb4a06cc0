// A serial line as an oscilloscope shows it, by the definition of 8N1 alone: nothing here knows of
// patterns. Times are exact fractions.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace bushd::test {

// A time in seconds: num / den, den > 0. Sums of what has few different denominators stay small.
class Fraction {
 public:
  Fraction(__int128_t num = 0, __int128_t den = 1) : num_(num), den_(den) { reduce(); }
  friend Fraction operator+(const Fraction& a, const Fraction& b) {
    return {a.num_ * b.den_ + b.num_ * a.den_, a.den_ * b.den_};
  }
  friend Fraction operator-(const Fraction& a, const Fraction& b) {
    return {a.num_ * b.den_ - b.num_ * a.den_, a.den_ * b.den_};
  }
  friend bool operator<(const Fraction& a, const Fraction& b) {
    return a.num_ * b.den_ < b.num_ * a.den_;
  }
  double seconds() const { return static_cast<double>(num_) / static_cast<double>(den_); }

 private:
  void reduce() {
    __int128_t a = num_ < 0 ? -num_ : num_;
    __int128_t b = den_;
    while (b != 0) {
      const __int128_t rest = a % b;
      a = b;
      b = rest;
    }
    if (a > 1) {
      num_ /= a;
      den_ /= a;
    }
  }
  __int128_t num_;
  __int128_t den_;
};

// When the line falls, counted from the beginning of the byte, in bits.
inline std::vector<unsigned> falls_of(std::uint8_t byte) {
  std::vector<bool> levels = {true, false};  // idle, start
  for (unsigned bit = 0; bit < 8; ++bit) levels.push_back((byte >> bit & 1) != 0);
  levels.push_back(true);  // stop
  std::vector<unsigned> falls;
  for (unsigned i = 1; i < levels.size(); ++i) {
    if (levels[i - 1] && !levels[i]) falls.push_back(i - 1);
  }
  return falls;
}

}  // namespace bushd::test
