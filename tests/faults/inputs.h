// What is wired to the MCUs' inputs: limit switches and emergency inputs that somebody presses,
// switches that motors run into, and the trigger.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "sim/bus.h"
#include "sim/plant.h"
#include "sim/random.h"
#include "witness.h"

namespace bushfaults {

class Inputs {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // All of them outlive it. The MCUs are on the bus by now.
  Inputs(const bushd::config::Config& config, bushd::sim::Bus& bus, bushd::sim::Plant& plant,
         Witness& witness, std::uint64_t seed);

  // Each for as long as chance has it; what it was, for the story.
  std::string press_limit(TimeNs now_ns, bushd::sim::Random& random);
  std::string press_emergency(TimeNs now_ns, bushd::sim::Random& random);
  // An edge at the trigger inputs of all MCUs, or of one.
  std::string trigger(TimeNs now_ns, bushd::sim::Random& random);

  // What has been pressed for long enough is released.
  void run(TimeNs now_ns);
  // When all of it is.
  TimeNs released_ns() const;

 private:
  void add_shutter_switches(std::size_t motor);
  void set(std::size_t mcu);
  void watch_switches(TimeNs now_ns);

  const bushd::config::Config& config_;
  bushd::sim::Bus& bus_;
  bushd::sim::Plant& plant_;
  Witness& witness_;
  std::vector<TimeNs> limit_until_ns_;      // by motor; 0: not pressed
  std::vector<TimeNs> emergency_until_ns_;  // by MCU; 0: not pressed
  std::vector<bool> trigger_;               // by MCU: its level
  // By motor: what it runs into.
  std::vector<std::vector<bushd::sim::SwitchOptions>> switches_;
};

}  // namespace bushfaults
