// Randomness that can be repeated: streams that one seed gives, each independent of how much the
// others have been used. The same on every platform (unlike the distributions of <random>).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>

namespace bushd::sim {

class Random {
 public:
  Random(std::uint64_t seed, std::uint32_t stream) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           stream};
    engine_.seed(sequence);
  }

  // 0 .. count-1. Precondition: count > 0. The bias of the remainder is below count / 2^64.
  std::uint64_t below(std::uint64_t count) { return engine_() % count; }
  // first .. last. Precondition: first <= last.
  std::int64_t between(std::int64_t first, std::int64_t last) {
    return first + static_cast<std::int64_t>(below(static_cast<std::uint64_t>(last - first) + 1));
  }
  bool one_in(std::uint64_t count) { return below(count) == 0; }
  template <typename Container>
  auto& pick(Container& from) {
    return from[static_cast<std::size_t>(below(from.size()))];
  }
  // Like `between`, but every order of magnitude is as likely as the others. Precondition: 0 <
  // first <= last.
  std::int64_t magnitude(std::int64_t first, std::int64_t last) {
    const double span = std::log(static_cast<double>(last) / static_cast<double>(first));
    return static_cast<std::int64_t>(static_cast<double>(first) * std::exp(span * unit()));
  }
  // Time to the next of events that come at random, `mean` apart.
  std::int64_t wait(double mean) { return static_cast<std::int64_t>(-mean * std::log1p(-unit())); }
  // [0, 1), of 53 bits.
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace bushd::sim
