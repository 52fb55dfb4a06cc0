// What each MCU hears on the bus, read by another pair of ears than its firmware's: of the frames
// that mean something to all motors or clocks at once, or make it report.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/frame.h"
#include "sim/bus.h"
#include "sim/plant.h"
#include "skew.h"
#include "witness.h"

namespace bushfaults {

class Overheard {
 public:
  // All of them outlive it. Takes Bus::on_mcu_byte.
  Overheard(bushd::sim::Bus& bus, bushd::sim::Plant& plant, Skew& skew, Witness& witness);
  ~Overheard();
  Overheard(const Overheard&) = delete;
  Overheard& operator=(const Overheard&) = delete;

  // What it was hearing is lost.
  void mcu_reset(std::size_t mcu) { receiver_[mcu] = {}; }

 private:
  using TimeNs = bushd::sim::TimeNs;
  void frame(TimeNs now_ns, std::size_t mcu, const bushd_frame& frame);

  bushd::sim::Bus& bus_;
  bushd::sim::Plant& plant_;
  Skew& skew_;
  Witness& witness_;
  std::vector<bushd_receiver> receiver_;  // by MCU
};

}  // namespace bushfaults
