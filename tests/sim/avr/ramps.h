// Runs as they are made to the image for ATmega2560 by tests of its slots.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace bushd::sim {

// A side of 238 codes, from 1000 / 280 of the cruise down.
inline std::vector<std::uint16_t> ramp_to(std::uint16_t cruise) {
  std::vector<std::uint16_t> codes;
  for (int i = 0; i < 238; ++i) {
    codes.push_back(static_cast<std::uint16_t>(cruise * (1000 - 3 * i) / 280));
  }
  return codes;
}

// Delays of the steps 1..n of a run by that, from rest to rest: max(A(k-1), D(n-k), c).
inline std::vector<std::uint16_t> delays_of_run(std::uint16_t cruise, std::size_t n) {
  const std::vector<std::uint16_t> ramp = ramp_to(cruise);
  const auto code = [&](std::size_t i) { return i < ramp.size() ? ramp[i] : cruise; };
  std::vector<std::uint16_t> delays;
  for (std::size_t k = 1; k <= n; ++k) {
    delays.push_back(std::max({code(k - 1), code(n - k), cruise}));
  }
  return delays;
}

}  // namespace bushd::sim
