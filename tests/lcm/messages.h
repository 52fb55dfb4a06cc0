// Messages for tests: fixed ones of a wanted size, and random ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>

#include "bushd/command_t.hpp"
#include "bushd/health_t.hpp"
#include "bushd/reply_t.hpp"
#include "bushd/state_t.hpp"
#include "bushd/table_reply_t.hpp"
#include "bushd/table_request_t.hpp"

namespace bushd::test {

using Random = std::mt19937_64;

inline std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

template <class Number>
Number any(Random& random) {
  return static_cast<Number>(random());
}

inline std::string text(Random& random) {
  std::string out(below(random, 24), ' ');
  for (char& c : out) c = static_cast<char>(1 + below(random, 255));
  return out;
}

inline void fill(Random& random, command_t& command) {
  command.utime_us = any<std::int64_t>(random);
  command.client_id = text(random);
  command.number = any<std::int64_t>(random);
  command.kind = any<std::int8_t>(random);
  command.group = text(random);
  command.table = text(random);
  command.dry_run = any<std::int8_t>(random);
  command.edge = any<std::int8_t>(random);
  command.arrivals = any<std::int8_t>(random);
  command.delay_us = any<std::int32_t>(random);
  command.width_us = any<std::int32_t>(random);
  for (std::size_t i = below(random, 5); i > 0; --i) {
    command.motors.push_back(text(random));
    command.steps.push_back(any<std::int64_t>(random));
  }
  command.motor_count = static_cast<std::int32_t>(command.motors.size());
}

inline table_ref_t table_ref(Random& random) {
  table_ref_t table{};
  table.name = text(random);
  table.revision = any<std::int32_t>(random);
  table.hash = text(random);
  return table;
}

inline move_plan_t move_plan(Random& random) {
  move_plan_t plan{};
  plan.frames = any<std::int64_t>(random);
  for (std::size_t i = below(random, 4); i > 0; --i) {
    plan.motors.push_back(text(random));
    plan.steps.push_back(any<std::int64_t>(random));
    plan.motor_duration_us.push_back(any<std::int64_t>(random));
    plan.peak_steps_per_s.push_back(static_cast<double>(any<std::int32_t>(random)));
  }
  plan.motor_count = static_cast<std::int32_t>(plan.motors.size());
  return plan;
}

inline table_t any_table(Random& random) {
  table_t table{};
  table.name = text(random);
  table.description = text(random);
  table.revision = any<std::int32_t>(random);
  table.hash = text(random);
  table.time_unit_ns = any<std::int64_t>(random);
  for (std::size_t i = below(random, 6); i > 0; --i)
    table.accel.push_back(any<std::int32_t>(random));
  for (std::size_t i = below(random, 4); i > 0; --i)
    table.decel.push_back(any<std::int32_t>(random));
  table.accel_count = static_cast<std::int32_t>(table.accel.size());
  table.decel_count = static_cast<std::int32_t>(table.decel.size());
  return table;
}

inline void fill(Random& random, table_request_t& request) {
  request.utime_us = any<std::int64_t>(random);
  request.client_id = text(random);
  request.number = any<std::int64_t>(random);
  request.kind = any<std::int8_t>(random);
  request.table = text(random);
  request.expected_hash = text(random);
  for (std::size_t i = below(random, 3); i > 0; --i) request.content.push_back(any_table(random));
  request.content_count = static_cast<std::int32_t>(request.content.size());
}

inline void fill(Random& random, table_reply_t& reply) {
  reply.utime_us = any<std::int64_t>(random);
  reply.client_id = text(random);
  reply.number = any<std::int64_t>(random);
  reply.done = any<std::int8_t>(random);
  reply.reason = text(random);
  for (std::size_t i = below(random, 4); i > 0; --i) {
    table_entry_t entry{};
    entry.name = text(random);
    entry.table = table_ref(random);
    entry.fault = text(random);
    entry.codes = any<std::int32_t>(random);
    reply.entries.push_back(entry);
  }
  reply.entry_count = static_cast<std::int32_t>(reply.entries.size());
  for (std::size_t i = below(random, 3); i > 0; --i) reply.tables.push_back(any_table(random));
  reply.table_count = static_cast<std::int32_t>(reply.tables.size());
}

inline void fill(Random& random, reply_t& reply) {
  reply.utime_us = any<std::int64_t>(random);
  reply.client_id = text(random);
  reply.number = any<std::int64_t>(random);
  reply.phase = any<std::int8_t>(random);
  reply.result = text(random);
  reply.reason = text(random);
  for (std::size_t i = below(random, 5); i > 0; --i) {
    reply.motors.push_back(text(random));
    reply.motor_results.push_back(text(random));
    reply.position_steps.push_back(any<std::int64_t>(random));
    reply.table_of_motor.push_back(any<std::int16_t>(random));
  }
  reply.motor_count = static_cast<std::int32_t>(reply.motors.size());
  for (std::size_t i = below(random, 4); i > 0; --i) reply.tables.push_back(table_ref(random));
  reply.table_count = static_cast<std::int32_t>(reply.tables.size());
  for (std::size_t i = below(random, 3); i > 0; --i) reply.plan.push_back(move_plan(random));
  reply.plan_count = static_cast<std::int32_t>(reply.plan.size());
}

inline table_ref_t table_ref() {
  table_ref_t table{};
  table.name = "bushd2-constant";
  table.revision = 3;
  table.hash = "0a1b2c3d";
  return table;
}

inline motor_state_t motor_state(const std::string& name) {
  motor_state_t motor{};
  motor.name = name;
  motor.group = "goniometer";
  motor.table = table_ref();
  motor.trust = "known";
  return motor;
}

inline void fill(Random& random, state_t& state) {
  state.utime_us = any<std::int64_t>(random);
  state.sequence = any<std::int64_t>(random);
  state.part = any<std::int32_t>(random);
  state.parts = any<std::int32_t>(random);
  state.bus = text(random);
  state.mcu = text(random);
  state.address = any<std::int32_t>(random);
  state.mcu_state = text(random);
  state.detail = text(random);
  state.inputs = text(random);
  state.boot_number = any<std::int32_t>(random);
  state.tick = any<std::int64_t>(random);
  state.rejected_commands = any<std::int64_t>(random);
  for (std::size_t i = below(random, 4); i > 0; --i) {
    motor_state_t motor = motor_state(text(random));
    motor.table = table_ref(random);
    motor.output = any<std::int16_t>(random);
    motor.position_steps = any<std::int64_t>(random);
    motor.target_steps = any<std::int64_t>(random);
    motor.velocity_steps_per_s = static_cast<double>(any<std::int32_t>(random)) / 256;
    motor.moving = any<std::int8_t>(random);
    motor.armed = any<std::int8_t>(random);
    motor.activity = text(random);
    motor.enabled = any<std::int8_t>(random);
    motor.input = any<std::int8_t>(random);
    motor.forbidden = text(random);
    state.motors.push_back(motor);
  }
  state.motor_count = static_cast<std::int32_t>(state.motors.size());
}

inline mcu_health_t mcu_health(const std::string& mcu) {
  mcu_health_t health{};
  health.mcu = mcu;
  health.unique_id = "0123456789abcdef";
  health.low_water_ticks = -1;
  return health;
}

inline void fill(Random& random, health_t& health) {
  health.utime_us = any<std::int64_t>(random);
  health.sequence = any<std::int64_t>(random);
  health.part = any<std::int32_t>(random);
  health.parts = any<std::int32_t>(random);
  health.bus = text(random);
  health.port_state = text(random);
  health.two_masters = any<std::int8_t>(random);
  health.crc_errors = any<std::int64_t>(random);
  health.stray_frames = any<std::int64_t>(random);
  health.recent_latency_us = any<std::int64_t>(random);
  for (std::size_t i = below(random, 9); i > 0; --i) {
    health.latency_below_us.push_back(any<std::int64_t>(random));
    health.latency_answers.push_back(any<std::int64_t>(random));
  }
  health.latency_count = static_cast<std::int32_t>(health.latency_answers.size());
  for (std::size_t i = below(random, 4); i > 0; --i) {
    mcu_health_t mcu = mcu_health(text(random));
    mcu.address = any<std::int32_t>(random);
    mcu.unique_id = text(random);
    mcu.boot_number = any<std::int32_t>(random);
    mcu.reset_cause = text(random);
    mcu.current = any<std::int32_t>(random);
    mcu.repeats = any<std::int64_t>(random);
    mcu.low_water_ticks = any<std::int32_t>(random);
    mcu.rate_ppm = static_cast<double>(any<std::int32_t>(random)) / 256;
    mcu.two_masters = any<std::int8_t>(random);
    health.mcus.push_back(mcu);
  }
  health.mcu_count = static_cast<std::int32_t>(health.mcus.size());
}

template <class T>
T random_message(Random& random) {
  T message{};
  fill(random, message);
  return message;
}

// One part of a snapshot, with motors "<name_stem>0", ... padded to `name_length`.
inline state_t state_part(std::int64_t sequence, std::int32_t part, std::int32_t parts,
                          std::size_t motors = 0, std::size_t name_length = 0) {
  state_t state{};
  state.sequence = sequence;
  state.part = part;
  state.parts = parts;
  state.bus = "hall";
  state.address = part + 1;
  state.mcu = "hall:" + std::to_string(state.address);
  state.mcu_state = "READY";
  for (std::size_t i = 0; i < motors; ++i) {
    std::string name = "m" + std::to_string(part) + "_" + std::to_string(i);
    if (name.size() < name_length) name.resize(name_length, 'x');
    state.motors.push_back(motor_state(name));
    state.motors.back().output = static_cast<std::int16_t>(i);
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
