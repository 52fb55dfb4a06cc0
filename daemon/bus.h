// One bus of the core: its master, and the answers to the master's question what motors shall do.
#pragma once

#include <functional>

#include "daemon/core.h"

namespace bushd::daemon {

// Answers for whatever axis it is told of.
struct AxisSource : link::TickSource {
  // Null where no motor is or where it does not move.
  virtual motion::Axis* moving_axis(link::McuIndex mcu, std::uint8_t motor) = 0;

  std::uint16_t render(link::McuIndex mcu, std::uint8_t motor, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override;
  std::optional<RunSegment> run_at(link::McuIndex mcu, std::uint8_t motor, link::Tick first,
                                   unsigned max_ticks) override;
  link::Tick end_tick(link::McuIndex mcu, std::uint8_t motor) override;
};

struct Core::Bus : AxisSource {
  Bus(link::BusSetup setup, Core& of) : core(of), master(std::move(setup), *this) {}

  motion::Axis* moving_axis(link::McuIndex mcu, std::uint8_t motor) override;

  Core& core;
  std::vector<std::size_t> mcus;  // indices in Core::mcus_, by index in the master
  link::Master master;
  std::string port_state = "not yet opened";
  bool two_masters = false;  // as told in the log last
};

}  // namespace bushd::daemon
