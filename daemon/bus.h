// One bus of the core: its master, and the answers to the master's question what motors shall do.
#pragma once

#include <functional>

#include "daemon/core.h"

namespace bushd::daemon {

struct Core::Bus : link::TickSource {
  Bus(link::BusSetup setup, Core& of) : core(of), master(std::move(setup), *this) {}

  std::uint16_t render(std::size_t mcu, std::uint8_t motor, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override;

  Core& core;
  std::vector<std::size_t> mcus;  // indices in Core::mcus_, by index in the master
  link::Master master;
};

}  // namespace bushd::daemon
