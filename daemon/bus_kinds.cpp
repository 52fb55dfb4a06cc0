#include "daemon/bus_kinds.h"

#include <utility>

#include "commutator/master.h"
#include "link/master.h"

namespace bushd::daemon {

std::unique_ptr<link::BusMaster> new_master(const config::Bus& bus, link::BusSetup setup,
                                            link::TickSource& source) {
  switch (bus.kind) {
    case config::BusKind::kRs485:
      break;
    case config::BusKind::kCommutator:
      return std::make_unique<commutator::Master>(
          commutator::Master::Setup{.name = bus.name,
                                    .board = {.start_hz = bus.start_hz,
                                              .baud = bus.baud,
                                              .answer_us = bus.answer_ms * std::int64_t{1000}}},
          std::move(setup), source);
  }
  return std::make_unique<link::Master>(std::move(setup), source);
}

}  // namespace bushd::daemon
