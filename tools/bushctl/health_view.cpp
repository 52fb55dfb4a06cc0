#include "health_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "base/printable.h"
#include "grid.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using Healths = std::vector<api::HealthSnapshot>;

// By bus; the daemon has one at least.
Healths healths_of(const bushd::client::Status& status) {
  Healths healths;
  for (const bushd::lcm::HealthMessage& bus : status.healths) healths.push_back(bus.snapshot);
  return healths;
}

std::string bound(std::int64_t below_us) {
  if (below_us == INT64_MAX) return "more";
  return fmt::format("<{} ms", static_cast<double>(below_us) / 1000);
}

std::vector<std::string> bus_lines(const Healths& health) {
  using enum Align;
  const auto ms = [](std::int64_t us) {
    return fmt::format("{:.1f}", static_cast<double>(us) / 1000);
  };
  Grid grid({kLeft, kRight, kRight, kRight, kRight, kLeft});
  grid.row({"BUS", "CRC ERRORS", "STRAY", "LATENCY MS", "START MARGIN MS", "PORT"});
  for (const api::HealthSnapshot& bus : health) {
    grid.row({bushd::printable(bus.bus), fmt::to_string(bus.crc_errors),
              fmt::to_string(bus.stray_frames), ms(bus.recent_latency_us),
              bus.start_margin_us == 0 ? "-" : ms(bus.start_margin_us),
              bushd::printable(bus.port_state) +
                  (bus.two_masters ? "; another master talks on the bus" : "")});
  }
  return grid.lines();
}

bool same_columns(const api::HealthSnapshot& a, const api::HealthSnapshot& b) {
  return std::ranges::equal(a.latency, b.latency, {}, &api::HealthSnapshot::Latency::below_us,
                            &api::HealthSnapshot::Latency::below_us);
}

std::vector<std::string> latency_lines(const Healths& health) {
  std::vector<Align> align(health.front().latency.size() + 1, Align::kRight);
  align.front() = Align::kLeft;
  Grid grid(align);
  std::vector<std::string> head = {"ANSWERS AFTER"};
  for (const auto& column : health.front().latency) head.push_back(bound(column.below_us));
  grid.row(head);
  for (const api::HealthSnapshot& bus : health) {
    if (!same_columns(bus, health.front())) continue;
    std::vector<std::string> row = {bushd::printable(bus.bus)};
    for (const auto& column : bus.latency) row.push_back(fmt::to_string(column.answers));
    grid.row(row);
  }
  return grid.lines();
}

std::vector<std::string> mcu_lines(const Healths& health) {
  using enum Align;
  std::vector<Align> align(17, kRight);
  align[0] = align[1] = align[4] = align[16] = kLeft;
  Grid grid(align);
  grid.row({"MCU", "UNIQUE ID", "FIRMWARE", "BOOT", "RESET BY", "CURRENT", "CRC ERRORS", "REJECTED",
            "TIMEOUTS", "REPEATS", "MISSED TICKS", "RUN-DOWNS", "RESTARTS", "LOW WATER", "RATE PPM",
            "OFFSET US", ""});
  for (const api::HealthSnapshot& bus : health) {
    for (const api::McuHealth& mcu : bus.mcus) {
      grid.row({bushd::printable(mcu.mcu),
                mcu.unique_id.empty() ? "-" : bushd::printable(mcu.unique_id),
                fmt::to_string(mcu.firmware_version), fmt::to_string(mcu.boot),
                mcu.reset_cause.empty() ? "-" : bushd::printable(mcu.reset_cause),
                fmt::to_string(mcu.current), fmt::to_string(mcu.crc_errors),
                fmt::to_string(mcu.rejected_frames), fmt::to_string(mcu.timeouts),
                fmt::to_string(mcu.repeats), fmt::to_string(mcu.missed_ticks),
                fmt::to_string(mcu.ramp_downs), fmt::to_string(mcu.restarts),
                mcu.low_water_ticks ? fmt::to_string(*mcu.low_water_ticks) : "-",
                fmt::format("{:+.1f}", mcu.rate_ppm), fmt::format("{:+.1f}", mcu.clock_offset_us),
                mcu.two_masters ? "hears two masters" : ""});
    }
  }
  return grid.lines();
}

}  // namespace

std::vector<std::string> health_table(const bushd::client::Status& status) {
  const Healths health = healths_of(status);
  std::vector<std::string> out;
  for (const auto& part : {bus_lines(health), latency_lines(health), mcu_lines(health)}) {
    if (!out.empty()) out.emplace_back();
    out.insert(out.end(), part.begin(), part.end());
  }
  return out;
}

std::string health_json(const bushd::client::Status& status) {
  nlohmann::ordered_json out = {{"buses", nlohmann::json::array()},
                                {"sequence", status.healths.front().part.sequence},
                                {"utime_us", status.healths.front().part.utime_us}};
  for (const auto& bus : healths_of(status)) out["buses"].push_back(bushd::json_of(bus));
  return bushd::json_text(out);
}

}  // namespace bushctl
