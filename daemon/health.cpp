// How well the buses do: told to clients once a second, and one thing told to people at once: that
// somebody else talks on a line.
#include "daemon/bus.h"
#include "daemon/core.h"
#include "daemon/faults.h"
#include "link/unique_id.h"

namespace bushd::daemon {
namespace {

std::int64_t number(std::uint64_t count) {
  return static_cast<std::int64_t>(count);
}

}  // namespace

void Core::watch_for_other_masters(std::int64_t now_us) {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    const bool now = buses_[b]->master.two_masters(now_us);
    if (now == buses_[b]->two_masters) continue;
    buses_[b]->two_masters = now;
    changed_ = true;
    const std::string& name = config_.buses[b].name;
    if (now) {
      outputs_.log(LogLevel::kError, "bus " + name +
                                         ": another master talks on the line; no moves are taken "
                                         "until it is silent");
    } else {
      outputs_.log(LogLevel::kInfo, "bus " + name + ": the other master is silent");
    }
  }
}

mcu_health_t Core::health_of(const Mcu& mcu) const {
  const link::McuView& view = view_of(mcu);
  const link::McuHealth& health = master_of(mcu).health(mcu.in_bus);
  mcu_health_t out;
  out.mcu = mcu.config->id;
  out.address = mcu.config->address.value;
  out.unique_id = view.identified ? link::unique_id_text(view.identity) : std::string();
  out.firmware_version = view.identified ? view.identity.firmware_version : 0;
  out.boot_number = view.identified ? view.identity.boot_number : 0;
  out.reset_cause = view.reported ? reset_cause_word(view.report.reset_cause) : std::string();
  out.current = view.reported ? view.report.current : 0;
  out.crc_errors = number(health.crc_errors);
  out.rejected_frames = number(health.rejected_frames);
  out.run_downs = number(health.ramp_downs);
  out.timeouts = number(health.timeouts);
  out.repeats = number(health.repeats);
  out.missed_ticks = number(health.missed_ticks);
  out.restarts = number(health.restarts);
  out.low_water_ticks = health.low_water_ticks ? int{*health.low_water_ticks} : -1;
  out.rate_ppm = health.rate_ppm;
  out.clock_offset_us = health.clock_offset_us;
  out.two_masters = view.phase != link::McuPhase::kOffline && view.reported &&
                    (view.report.flags & BUSHD_FLAG_TWO_MASTERS) != 0;
  return out;
}

health_t Core::health_of(const Bus& bus, const config::Bus& config) const {
  const link::BusHealth& health = bus.master.bus_health();
  health_t out;
  out.bus = config.name;
  out.port_state = bus.port_state;
  out.two_masters = bus.two_masters;
  out.crc_errors = number(health.crc_errors);
  out.stray_frames = number(health.stray_frames);
  out.recent_latency_us = health.latency.recent_us;
  out.latency_below_us.assign(link::Latency::kBoundsUs.begin(), link::Latency::kBoundsUs.end());
  out.latency_below_us.push_back(INT64_MAX);
  for (const std::uint64_t answers : health.latency.count) {
    out.latency_answers.push_back(number(answers));
  }
  out.latency_count = static_cast<std::int32_t>(out.latency_answers.size());
  for (const std::size_t mcu : bus.mcus) out.mcus.push_back(health_of(mcus_[mcu]));
  out.mcu_count = static_cast<std::int32_t>(out.mcus.size());
  return out;
}

void Core::publish_health() {
  ++health_sequence_;
  const std::int64_t now = outputs_.wall_clock_us();
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    health_t health = health_of(*buses_[b], config_.buses[b]);
    health.utime_us = now;
    health.sequence = health_sequence_;
    health.part = static_cast<std::int32_t>(b);
    health.parts = static_cast<std::int32_t>(buses_.size());
    outputs_.health(health);
    buses_[b]->master.reset_low_water();
  }
}

}  // namespace bushd::daemon
