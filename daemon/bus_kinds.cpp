#include "daemon/bus_kinds.h"

#include <utility>

#include "link/master.h"

namespace bushd::daemon {

std::unique_ptr<link::BusMaster> new_master(const config::Bus& bus, link::BusSetup setup,
                                            link::TickSource& source) {
  switch (bus.kind) {
    case config::BusKind::kRs485:
      break;
  }
  return std::make_unique<link::Master>(std::move(setup), source);
}

}  // namespace bushd::daemon
