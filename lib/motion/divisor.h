// One number to divide by many times, by way of its reciprocal.
#pragma once

#include <cstdint>

namespace bushd::motion {

class Divisor {
 public:
  // Precondition: >= 1.
  explicit Divisor(std::uint32_t by = 1) : by_(by), reciprocal_(UINT64_MAX / by) {}

  // Precondition: number < 2^63.
  std::uint64_t quotient(std::uint64_t number) const {
    __extension__ using Wide = unsigned __int128;
    const auto quotient = static_cast<std::uint64_t>((Wide{number} * reciprocal_) >> 64);
    // The reciprocal is rounded down: this is at most one too small.
    return quotient + (number - quotient * by_ >= by_ ? 1 : 0);
  }

 private:
  std::uint64_t by_;
  std::uint64_t reciprocal_;
};

}  // namespace bushd::motion
