#include "daemon/model/bus_kinds.h"

#include <utility>

#include "bus/rs485/master.h"
#include "heritage/commutator/master.h"
#include "heritage/serial_pulse/master.h"

namespace bushd::daemon {
namespace {

// FNV-1a. By it a port is known again that has no number of its own, as the bus that it is.
std::uint64_t hash_of(const std::string& name) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3;
  return hash;
}

}  // namespace

std::unique_ptr<link::BusMaster> new_master(const config::Bus& bus, link::BusSetup setup,
                                            link::TickSource& source) {
  switch (bus.kind) {
    case config::BusKind::kSerialPulse:
      return std::make_unique<serial_pulse::SerialPulseMaster>(std::move(setup), source,
                                                               hash_of(bus.name));
    case config::BusKind::kRs485:
      break;
    case config::BusKind::kCommutator:
      return std::make_unique<commutator::CommutatorMaster>(
          commutator::CommutatorMaster::Setup{
              .name = bus.name,
              .board = {.start_hz = bus.start_hz,
                        .baud = bus.baud,
                        .answer_us = bus.answer_ms * std::int64_t{1000},
                        .converter = bus.converter}},
          std::move(setup), source);
  }
  return std::make_unique<link::Rs485Master>(std::move(setup), source);
}

}  // namespace bushd::daemon
