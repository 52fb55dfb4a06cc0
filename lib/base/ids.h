// Identifiers of what a configuration names. Each is its own type: a mix-up moves the wrong motor.
//
// Buses, MCUs, groups and motors are numbered from 0 in the order of the configuration; the numbers
// are valid for one run of the daemon and never leave it. Clients use names.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace bushd {

template <class Tag>
struct Id {
  std::size_t value = 0;
  auto operator<=>(const Id&) const = default;
};

using BusId = Id<struct BusTag>;
using McuId = Id<struct McuTag>;
using GroupId = Id<struct GroupTag>;
using MotorId = Id<struct MotorTag>;

// Number of an MCU on the bus, 1..255.
struct McuAddress {
  std::uint8_t value = 0;
  auto operator<=>(const McuAddress&) const = default;
};

// Number of a motor at its MCU, 0..15.
struct Output {
  std::uint8_t value = 0;
  auto operator<=>(const Output&) const = default;
};

}  // namespace bushd

template <class Tag>
struct std::hash<bushd::Id<Tag>> {
  std::size_t operator()(bushd::Id<Tag> id) const noexcept { return id.value; }
};
