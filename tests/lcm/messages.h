// Messages of a wanted size, and what random ones are made of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include "bushd/health_t.hpp"
#include "bushd/mcu_state_t.hpp"

namespace bushd::test {

using Random = std::mt19937_64;

inline std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

inline std::string text(Random& random) {
  std::string out(below(random, 24), ' ');
  for (char& c : out) c = static_cast<char>(1 + below(random, 255));
  return out;
}

inline motor_t motor(const std::string& name) {
  motor_t motor{};
  motor.name = name;
  motor.activity = "rest";
  motor.trust = "known";
  return motor;
}

inline mcu_health_t mcu_health(const std::string& mcu) {
  mcu_health_t health{};
  health.mcu = mcu;
  health.unique_id = "0123456789abcdef";
  health.low_water_ticks = -1;
  return health;
}

// One part of a snapshot, with motors "<name_stem>0", ... padded to `name_length`.
inline mcu_state_t state_part(std::int64_t sequence, std::int32_t part, std::int32_t parts,
                              std::size_t motors = 0, std::size_t name_length = 0) {
  mcu_state_t state{};
  state.sequence = sequence;
  state.part = part;
  state.parts = parts;
  state.bus = "hall";
  state.mcu = "hall:" + std::to_string(part + 1);
  state.state = "READY";
  for (std::size_t i = 0; i < motors; ++i) {
    std::string name = "m" + std::to_string(part) + "_" + std::to_string(i);
    if (name.size() < name_length) name.resize(name_length, 'x');
    state.motors.push_back(motor(name));
  }
  state.motor_count = static_cast<std::int32_t>(motors);
  return state;
}

// One part of the buses' health, with `mcus` MCUs on the bus, named by `bus`.
inline health_t health_part(std::int64_t sequence, std::int32_t part, std::int32_t parts,
                            int mcus = 0, const std::string& bus = "hall") {
  health_t health{};
  health.sequence = sequence;
  health.part = part;
  health.parts = parts;
  health.bus = bus;
  health.port_state = "open";
  health.latency_below_us = {1000, INT64_MAX};
  health.latency_answers = {7, 1};
  health.latency_count = 2;
  for (int address = 1; address <= mcus; ++address) {
    health.mcus.push_back(mcu_health(bus + ":" + std::to_string(address)));
    health.mcus.back().address = address;
  }
  health.mcu_count = mcus;
  return health;
}

}  // namespace bushd::test
