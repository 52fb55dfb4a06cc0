// Codes K of a DAC before a voltage-to-frequency converter, for speeds (V. M. Ivanov, 2023):
//
//     K = K_m f / f_m                  f_m is the frequency of the code K_m
//
// rounded down, so that no step comes sooner than its delay 1 / f as long as the converter gives
// what it is to give. K rises with f, and is K_m from f_m on.
#pragma once

#include <algorithm>
#include <cstdint>

namespace bushd {

struct Converter {
  std::uint32_t max_hz;    // f_m
  std::uint32_t max_code;  // K_m, 1..255
  friend bool operator==(const Converter&, const Converter&) = default;
};

inline constexpr std::uint32_t kMaxConverterHz = 10'000;
inline constexpr std::uint32_t kMaxConverterCode = 255;
// f_m / K_m, the frequency of the code 1, is this at least: so each code has a pulse within half of
// the time after which a board takes its converter for dead.
inline constexpr std::uint32_t kLeastHzPerCode = 2;

// From one pulse to the next, rounded up. Precondition: code > 0.
constexpr std::uint64_t converter_period_ns(const Converter& of, std::uint32_t code) {
  const std::uint64_t hz = std::uint64_t{of.max_hz} * code;
  return (std::uint64_t{of.max_code} * 1'000'000'000 + hz - 1) / hz;
}

// K; 0: the delay is longer than that of the code 1.
constexpr std::uint32_t converter_code(const Converter& of, std::uint64_t delay_ns) {
  const std::uint64_t full = std::uint64_t{of.max_code} * 1'000'000'000;
  // Before it is multiplied: a delay may have 64 bits.
  if (delay_ns > full / of.max_hz) return 0;
  const std::uint64_t code = full / (std::max<std::uint64_t>(delay_ns, 1) * of.max_hz);
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(code, of.max_code));
}

}  // namespace bushd
