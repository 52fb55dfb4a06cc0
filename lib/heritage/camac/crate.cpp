#include "heritage/camac/crate.h"

#include <cstddef>

namespace bushd::camac {
namespace {

constexpr int kCommonControls = 28;  // N of Z and C
constexpr int kController = 30;      // N of the controller's own registers

constexpr int kInitialise = 8;  // subaddresses of these
constexpr int kClear = 9;
constexpr int kInhibit = 9;
constexpr int kDemand = 10;
constexpr int kDemandPresent = 11;
constexpr int kLastGraded = 7;

constexpr int kRead = 0;  // functions
constexpr int kDisable = 24;
constexpr int kEnable = 26;
constexpr int kTest = 27;

// Enables, disables or tests one bit.
Response switch_bit(int function, bool& bit) {
  if (function == kTest) return {.x = true, .q = bit};
  if (function != kEnable && function != kDisable) return {};
  bit = function == kEnable;
  return {.x = true};
}

bool is_station(int station) {
  return station >= 1 && station <= kStations;
}

}  // namespace

void Crate::insert(int station, Module& module) {
  modules_[static_cast<std::size_t>(station - 1)] = &module;
  module.set_inhibit(inhibited_);
}

const Module* Crate::at(int station) const {
  return is_station(station) ? modules_[static_cast<std::size_t>(station - 1)] : nullptr;
}

Response Crate::cycle(int station, const Command& command) {
  if (!is_station(station)) return controller_cycle(station, command);
  Module* module = modules_[static_cast<std::size_t>(station - 1)];
  if (module == nullptr) return {};
  Command seen = command;
  seen.data = writes(command.function) ? command.data & kDataMask : 0;
  return module->cycle(seen);
}

Response Crate::controller_cycle(int station, const Command& command) {
  const int a = command.subaddress;
  const int f = command.function;
  if (station == kCommonControls && f == kEnable) {
    if (a != kInitialise && a != kClear) return {};
    a == kInitialise ? initialise() : clear();
    return {.x = true};
  }
  if (station != kController) return {};
  if (f == kRead && a >= 0 && a <= kLastGraded) return {.x = true, .q = true, .data = requests()};
  if (a == kDemand) return switch_bit(f, demand_enabled_);
  if (a == kDemandPresent && f == kTest) return {.x = true, .q = requests() != 0};
  if (a != kInhibit) return {};
  bool inhibited = inhibited_;
  const Response response = switch_bit(f, inhibited);
  if (inhibited != inhibited_) set_inhibit(inhibited);
  return response;
}

void Crate::initialise() {
  for (Module* module : modules_) {
    if (module != nullptr) module->initialise();
  }
}

void Crate::clear() {
  for (Module* module : modules_) {
    if (module != nullptr) module->clear();
  }
}

void Crate::set_inhibit(bool inhibited) {
  inhibited_ = inhibited;
  for (Module* module : modules_) {
    if (module != nullptr) module->set_inhibit(inhibited);
  }
}

std::uint32_t Crate::requests() const {
  std::uint32_t lines = 0;
  for (std::size_t i = 0; i < modules_.size(); ++i) {
    if (modules_[i] != nullptr && modules_[i]->lam()) lines |= 1U << i;
  }
  return lines;
}

}  // namespace bushd::camac
