#include "sim/frequency_converter.h"

#include <algorithm>
#include <cmath>

namespace bushd::sim {

double FrequencyConverter::hz_at(TimeNs time_ns) const {
  const double time_s = static_cast<double>(time_ns) * 1e-9;
  return character_.hz_per_code * (code_ + character_.offset_codes) *
         (1 + character_.drift_per_s * time_s);
}

// From now_ns_ on: f is linear in time, so its integral is the mean of both ends, over the part of
// the time in which it is positive.
double FrequencyConverter::periods_in(TimeNs until_ns) const {
  const double from_hz = hz_at(now_ns_);
  const double to_hz = hz_at(until_ns);
  double positive_s = static_cast<double>(until_ns - now_ns_) * 1e-9;
  if (from_hz * to_hz < 0) positive_s *= std::max(from_hz, to_hz) / std::abs(to_hz - from_hz);
  return (std::max(from_hz, 0.0) + std::max(to_hz, 0.0)) / 2 * positive_s;
}

// With f = f_0 + s x the periods up to x are  f_0 x + s x^2 / 2 = p;  of its solutions the first:
// x = 2 p / (f_0 + sqrt(f_0^2 + 2 s p)).
TimeNs FrequencyConverter::next_pulse_ns() const {
  if (!character_.gives_pulses) return kNever;
  const double hz = hz_at(now_ns_);
  const double slope =
      character_.hz_per_code * (code_ + character_.offset_codes) * character_.drift_per_s;
  const double left = 1 - phase_;
  const double square = hz * hz + 2 * slope * left;
  if (hz <= 0 || square < 0) return kNever;
  const double wait_ns = std::ceil(2 * left / (hz + std::sqrt(square)) * 1e9);
  // Beyond a year it may as well be never.
  if (wait_ns > 3e16) return kNever;
  return now_ns_ + std::max(static_cast<TimeNs>(wait_ns), TimeNs{1});
}

void FrequencyConverter::advance(TimeNs now_ns) {
  for (TimeNs pulse_ns = next_pulse_ns(); pulse_ns <= now_ns; pulse_ns = next_pulse_ns()) {
    now_ns_ = pulse_ns;
    phase_ = 0;
    ++pulses_;
  }
  if (now_ns <= now_ns_) return;
  if (character_.gives_pulses) phase_ = std::min(phase_ + periods_in(now_ns), 1 - 1e-12);
  now_ns_ = now_ns;
}

void FrequencyConverter::set_code(TimeNs now_ns, std::uint8_t code) {
  advance(now_ns);
  code_ = code;
}

void FrequencyConverter::set_character(TimeNs now_ns, const Character& character) {
  advance(now_ns);
  character_ = character;
}

}  // namespace bushd::sim
