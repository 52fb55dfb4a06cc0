// A voltage-to-frequency converter behind a DAC, for simulations. Its frequency at the time t is
//
//     f = gain (K + offset) (1 + drift t)        and 0 where that is negative
//
// A pulse comes when the integral of f since the last one is 1: what is over of a period stays when
// K changes, as the charge of an integrator does. Not modelled: noise, and the DAC's own time.
#pragma once

#include <cstdint>
#include <limits>

#include "sim/edge.h"

namespace bushd::sim {

class FrequencyConverter {
 public:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();

  struct Character {
    double hz_per_code = 0;    // gain
    double offset_codes = 0;   // of DAC and converter
    double drift_per_s = 0;    // of the gain, since time 0
    bool gives_pulses = true;  // else its cable is off
  };
  explicit FrequencyConverter(const Character& character) : character_(character) {}

  // Times never fall, here and below. Both count the pulses up to then.
  void set_code(TimeNs now_ns, std::uint8_t code);
  void set_character(TimeNs now_ns, const Character& character);
  std::uint8_t code() const { return code_; }
  const Character& character() const { return character_; }

  // As long as nothing changes: on a whole nanosecond, rounded up.
  TimeNs next_pulse_ns() const;
  void advance(TimeNs now_ns);
  std::uint64_t pulses() const { return pulses_; }  // since the beginning

 private:
  double hz_at(TimeNs time_ns) const;
  double periods_in(TimeNs until_ns) const;

  Character character_;
  std::uint8_t code_ = 0;
  TimeNs now_ns_ = 0;
  double phase_ = 0;  // periods since the last pulse, at now_ns_; < 1
  std::uint64_t pulses_ = 0;
};

}  // namespace bushd::sim
