#include "render.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/printable.h"
#include "grid.h"

namespace bushctl {
namespace {

using bushd::motor_state_t;
using bushd::state_t;
using bushd::table_ref_t;
using bushd::lcm::Snapshot;

std::string text_of(const table_ref_t& table) {
  const std::string revision = table.revision > 0 ? fmt::format("@{}", table.revision) : "";
  return bushd::printable(table.name) + revision;
}

std::string limit_text(const motor_state_t& motor) {
  return motor.forbidden.empty() ? "" : "limit " + bushd::printable(motor.forbidden);
}

// What it does, in a word for tables.
const char* moving_word(const motor_state_t& motor, const char* moves, const char* rests) {
  if (motor.armed != 0) return "armed";
  return motor.moving != 0 ? moves : rests;
}

// By itself, or as a move says.
const char* moves_text(const motor_state_t& motor) {
  if (motor.activity == "home") return "home";
  return motor.activity == "local" ? "local" : "yes";
}

nlohmann::json motor_json(const motor_state_t& motor, const state_t& mcu) {
  return {{"name", motor.name},
          {"mcu", mcu.mcu},
          {"output", motor.output},
          {"group", motor.group},
          {"table", motor.table.name},
          {"table_revision", motor.table.revision},
          {"table_hash", motor.table.hash},
          {"position_steps", motor.position_steps},
          {"target_steps", motor.target_steps},
          {"velocity_steps_per_s", motor.velocity_steps_per_s},
          {"moving", motor.moving != 0},
          {"armed", motor.armed != 0},
          {"activity", motor.activity},
          {"enabled", motor.enabled != 0},
          {"input", motor.input != 0},
          {"forbidden", motor.forbidden},
          {"trust", motor.trust}};
}

nlohmann::json mcu_json(const state_t& mcu) {
  return {{"mcu", mcu.mcu},          {"bus", mcu.bus},       {"address", mcu.address},
          {"state", mcu.mcu_state},  {"detail", mcu.detail}, {"inputs", mcu.inputs},
          {"boot", mcu.boot_number}, {"tick", mcu.tick}};
}

}  // namespace

std::vector<std::string> table(const Snapshot& snapshot) {
  using enum Align;
  Grid motors({kLeft, kLeft, kRight, kLeft, kLeft, kRight, kRight, kRight, kLeft, kLeft, kLeft});
  motors.row({"MOTOR", "MCU", "OUTPUT", "GROUP", "TABLE", "POSITION", "TARGET", "STEPS/S", "MOVING",
              "TRUST", ""});
  Grid mcus({kLeft, kLeft, kRight, kLeft});
  mcus.row({"MCU", "STATE", "BOOT", "DETAIL"});
  for (const state_t& mcu : snapshot.mcus) {
    for (const motor_state_t& motor : mcu.motors) {
      motors.row({bushd::printable(motor.name), bushd::printable(mcu.mcu),
                  fmt::to_string(motor.output), bushd::printable(motor.group), text_of(motor.table),
                  fmt::to_string(motor.position_steps), fmt::to_string(motor.target_steps),
                  fmt::format("{:.1f}", motor.velocity_steps_per_s),
                  moving_word(motor, moves_text(motor), "-"), bushd::printable(motor.trust),
                  limit_text(motor)});
    }
    mcus.row({bushd::printable(mcu.mcu), bushd::printable(mcu.mcu_state),
              fmt::to_string(mcu.boot_number), bushd::printable(mcu.detail)});
  }
  std::vector<std::string> out = motors.lines();
  out.emplace_back();
  for (std::string& line : mcus.lines()) out.push_back(std::move(line));
  return out;
}

std::string motor_line(const motor_state_t& motor) {
  std::string line =
      fmt::format("{} position {} target {} velocity {:.1f} {}", bushd::printable(motor.name),
                  motor.position_steps, motor.target_steps, motor.velocity_steps_per_s,
                  moving_word(motor, "moving", "at rest"));
  if (motor.trust != "known") line += " " + bushd::printable(motor.trust);
  if (!motor.forbidden.empty()) line += " " + limit_text(motor);
  return line;
}

std::string json(const Snapshot& snapshot) {
  nlohmann::json out = {{"motors", nlohmann::json::array()},
                        {"mcus", nlohmann::json::array()},
                        {"sequence", snapshot.sequence},
                        {"utime_us", snapshot.mcus.front().utime_us},
                        {"rejected_commands", snapshot.mcus.front().rejected_commands}};
  for (const state_t& mcu : snapshot.mcus) {
    for (const motor_state_t& motor : mcu.motors) out["motors"].push_back(motor_json(motor, mcu));
    out["mcus"].push_back(mcu_json(mcu));
  }
  // Texts from the network need not be UTF-8; by default dump() throws then.
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string json(const bushd::move_plan_t& plan) {
  nlohmann::json out = {{"duration_us", plan.duration_us},
                        {"ticks", plan.ticks},
                        {"frames", plan.frames},
                        {"bytes", plan.bytes},
                        {"motors", nlohmann::json::array()}};
  // More than were counted.
  if (plan.frames < 0) out["frames"] = out["bytes"] = nullptr;
  for (std::size_t i = 0; i < plan.motors.size(); ++i) {
    out["motors"].push_back({{"name", plan.motors[i]},
                             {"steps", plan.steps[i]},
                             {"duration_us", plan.motor_duration_us[i]},
                             {"peak_steps_per_s", plan.peak_steps_per_s[i]}});
  }
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> lines(const bushd::move_plan_t& plan) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < plan.motors.size(); ++i) {
    out.push_back(fmt::format("{}: {:+} steps in {:.3f} s, up to {:.6g} steps/s",
                              bushd::printable(plan.motors[i]), plan.steps[i],
                              static_cast<double>(plan.motor_duration_us[i]) * 1e-6,
                              plan.peak_steps_per_s[i]));
  }
  const std::string traffic = plan.frames < 0
                                  ? "more frames than are counted"
                                  : fmt::format("{} frames of {} bytes", plan.frames, plan.bytes);
  out.push_back(fmt::format("{} ticks, {:.3f} s; {}", plan.ticks,
                            static_cast<double>(plan.duration_us) * 1e-6, traffic));
  return out;
}

std::vector<std::string> lines(const bushd::reply_t& reply) {
  if (reply.phase == bushd::reply_t::ACCEPTED) return {"accepted"};
  std::vector<std::string> out;
  for (std::size_t i = 0; i < reply.motors.size(); ++i) {
    std::string line =
        fmt::format("{}: {}, stands at {}", bushd::printable(reply.motors[i]),
                    bushd::printable(reply.motor_results[i]), reply.position_steps[i]);
    // Whatever the network says of an index is not believed.
    const auto table = static_cast<std::size_t>(reply.table_of_motor[i]);
    if (table < reply.tables.size()) {
      line += fmt::format(" by {} ({})", text_of(reply.tables[table]),
                          bushd::printable(reply.tables[table].hash));
    }
    out.push_back(std::move(line));
  }
  if (out.empty()) out.push_back(bushd::printable(reply.result));
  // Of what was done there may be more to tell.
  if (reply.result == "done" && reply.motors.empty()) {
    const bool repeats = reply.reason.starts_with(reply.result);
    out.back() = bushd::printable(repeats ? reply.reason : reply.result + ": " + reply.reason);
  }
  return out;
}

}  // namespace bushctl
