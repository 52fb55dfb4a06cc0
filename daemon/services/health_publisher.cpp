#include "daemon/services/health_publisher.h"

#include "bus/rs485/unique_id.h"
#include "motion/report_words.h"

namespace bushd::daemon {
namespace {

constexpr std::uint32_t kBitsPerByte = 10;  // a start bit, 8 bits, a stop bit

api::McuHealth health_of(const Mcu& mcu) {
  const link::McuView& view = mcu.view();
  const link::McuHealth& health = mcu.bus().health(mcu.on_bus());
  api::McuHealth out;
  out.mcu = mcu.name();
  out.address = mcu.config.address.value;
  if (view.identified) {
    out.unique_id = link::unique_id_text(view.identity);
    out.firmware_version = view.identity.firmware_version;
    out.boot = view.identity.boot_number;
  }
  if (view.reported) {
    out.reset_cause = motion::reset_cause_word(view.report.reset_cause);
    out.current = view.report.current;
  }
  out.crc_errors = health.crc_errors;
  out.rejected_frames = health.rejected_frames;
  out.ramp_downs = health.ramp_downs;
  out.timeouts = health.timeouts;
  out.repeats = health.repeats;
  out.missed_ticks = health.missed_ticks;
  out.restarts = health.restarts;
  if (health.low_water_ticks) out.low_water_ticks = int{*health.low_water_ticks};
  out.rate_ppm = health.rate_ppm;
  out.clock_offset_us = health.clock_offset_us;
  out.two_masters =
      !mcu.offline() && view.reported && (view.report.flags & BUSHD_FLAG_TWO_MASTERS) != 0;
  return out;
}

}  // namespace

api::HealthSnapshot HealthPublisher::health_of(std::int64_t now_us, const Bus& bus) const {
  const link::BusHealth& health = bus.master.bus_health();
  api::HealthSnapshot out;
  out.bus = bus.config.name;
  out.port_state = bus.port_state;
  out.two_masters = bus.two_masters;
  out.crc_errors = health.crc_errors;
  out.stray_frames = health.stray_frames;
  out.recent_latency_us = health.latency.recent_us;
  out.start_margin_us = bus.master.start_margin_us(now_us);
  out.line_bytes = health.line_bytes;
  out.line_bytes_per_s = bus.config.baud / kBitsPerByte;
  for (std::size_t i = 0; i < health.latency.count.size(); ++i) {
    const bool last = i == link::Latency::kBoundsUs.size();
    out.latency.push_back({.below_us = last ? INT64_MAX : link::Latency::kBoundsUs[i],
                           .answers = health.latency.count[i]});
  }
  for (const McuId mcu : bus.mcus) {
    out.mcus.push_back(daemon::health_of(installation_[mcu]));
  }
  return out;
}

void HealthPublisher::step(std::int64_t now_us) {
  if (now_us < due_us_) return;
  for (const BusId id : installation_.buses()) {
    outputs_.publish(id, health_of(now_us, installation_[id]));
    link::SharedLine* line = installation_[id].offers.shared_line;
    if (line != nullptr) line->reset_low_water();
  }
  due_us_ = now_us + kPeriodUs;
}

}  // namespace bushd::daemon
