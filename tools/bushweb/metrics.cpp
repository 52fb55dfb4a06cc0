#include "metrics.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string_view>

#include "api/snapshot.h"

namespace bushweb {
namespace {

namespace api = bushd::api;

constexpr std::array kTrusts{api::Trust::kUnknown, api::Trust::kKnown, api::Trust::kRestored,
                             api::Trust::kStale, api::Trust::kUncertain};

std::string label(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    out += c == '\n' ? std::string("\\n") : std::string(1, c);
  }
  return out;
}

class Writer {
 public:
  // A family begins: its samples follow.
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# TYPE {0} {1}\n# HELP {0} {2}\n", name, type, help);
  }
  template <class Value>
  void sample(std::string_view suffix, const std::string& labels, Value value) {
    text_ += fmt::format("{}{}{{{}}} {}\n", name_, suffix, labels, value);
  }
  std::string end() && { return std::move(text_) + "# EOF\n"; }

 private:
  std::string name_{};
  std::string text_{};
};

std::string of_daemon(const Measured& daemon) {
  return fmt::format(R"(daemon="{}")", label(daemon.daemon));
}

void each_motor(const std::vector<Measured>& daemons,
                const std::function<void(const std::string&, const api::MotorState&)>& tell) {
  for (const Measured& daemon : daemons) {
    for (const auto& message : daemon.status.states) {
      for (const api::MotorState& motor : message.snapshot.motors) {
        tell(fmt::format(R"({},mcu="{}",motor="{}")", of_daemon(daemon),
                         label(message.snapshot.mcu), label(motor.name)),
             motor);
      }
    }
  }
}

void each_bus(const std::vector<Measured>& daemons,
              const std::function<void(const std::string&, const api::HealthSnapshot&)>& tell) {
  for (const Measured& daemon : daemons) {
    for (const auto& message : daemon.status.healths) {
      tell(fmt::format(R"({},bus="{}")", of_daemon(daemon), label(message.snapshot.bus)),
           message.snapshot);
    }
  }
}

void each_mcu(const std::vector<Measured>& daemons,
              const std::function<void(const std::string&, const api::McuHealth&)>& tell) {
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    for (const api::McuHealth& mcu : bus.mcus) {
      tell(fmt::format(R"({},mcu="{}")", labels, label(mcu.mcu)), mcu);
    }
  });
}

void tell_motors(Writer& out, const std::vector<Measured>& daemons) {
  out.family("bushd_motor_position", "gauge",
             "Position in the motor's unit; left out while nobody knows it");
  each_motor(daemons, [&](const std::string& labels, const api::MotorState& motor) {
    if (motor.trust != api::Trust::kUnknown) out.sample("", labels, motor.user);
  });
  out.family("bushd_motor_position_steps", "gauge",
             "Position in steps; left out while nobody knows it");
  each_motor(daemons, [&](const std::string& labels, const api::MotorState& motor) {
    if (motor.trust != api::Trust::kUnknown) out.sample("", labels, motor.position_steps);
  });
  out.family("bushd_motor_speed_steps_per_second", "gauge", "Speed, with its sign");
  each_motor(daemons, [&](const std::string& labels, const api::MotorState& motor) {
    out.sample("", labels, motor.velocity_steps_per_s);
  });
  out.family("bushd_motor_moving", "gauge", "1 while it makes steps, or is about to");
  each_motor(daemons, [&](const std::string& labels, const api::MotorState& motor) {
    out.sample("", labels, motor.moving ? 1 : 0);
  });
  out.family("bushd_motor_trust", "stateset", "How far its position is to be trusted");
  each_motor(daemons, [&](const std::string& labels, const api::MotorState& motor) {
    for (const api::Trust trust : kTrusts) {
      out.sample("", fmt::format(R"({},bushd_motor_trust="{}")", labels, word(trust)),
                 trust == motor.trust ? 1 : 0);
    }
  });
}

void tell_mcus(Writer& out, const std::vector<Measured>& daemons) {
  out.family("bushd_mcu_ready", "gauge", "1 while it answers and has no fault");
  for (const Measured& daemon : daemons) {
    for (const auto& message : daemon.status.states) {
      out.sample("", fmt::format(R"({},mcu="{}")", of_daemon(daemon), label(message.snapshot.mcu)),
                 message.snapshot.state == api::McuState::kReady ? 1 : 0);
    }
  }
  struct Count {
    const char* name;
    const char* help;
    std::uint64_t api::McuHealth::* count;
  };
  constexpr std::array kCounts{
      Count{"bushd_mcu_crc_errors", "Frames that the MCU found damaged",
            &api::McuHealth::crc_errors},
      Count{"bushd_mcu_rejected_frames", "Frames that it did not take",
            &api::McuHealth::rejected_frames},
      Count{"bushd_mcu_ramp_downs", "Motors that ran dry and came to rest by their own table",
            &api::McuHealth::ramp_downs},
      Count{"bushd_mcu_timeouts", "Answers that did not come", &api::McuHealth::timeouts},
      Count{"bushd_mcu_repeats", "Frames that were sent again", &api::McuHealth::repeats},
      Count{"bushd_mcu_missed_ticks", "Ticks that came too late", &api::McuHealth::missed_ticks},
      Count{"bushd_mcu_restarts", "Restarts that the daemon saw", &api::McuHealth::restarts}};
  for (const Count& count : kCounts) {
    out.family(count.name, "counter", count.help);
    each_mcu(daemons, [&](const std::string& labels, const api::McuHealth& mcu) {
      out.sample("_total", labels, mcu.*count.count);
    });
  }
}

// Its classes count what is below; sums of latencies are not told.
void tell_latencies(Writer& out, const std::vector<Measured>& daemons) {
  out.family("bushd_bus_latency_seconds", "histogram", "From the end of a request to its answer");
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    std::uint64_t below = 0;
    for (const auto& latency : bus.latency) {
      below += latency.answers;
      const bool last = latency.below_us == std::numeric_limits<std::int64_t>::max();
      const std::string bound =
          last ? "+Inf" : fmt::to_string(static_cast<double>(latency.below_us) * 1e-6);
      out.sample("_bucket", fmt::format(R"({},le="{}")", labels, bound), below);
    }
    if (!bus.latency.empty()) out.sample("_count", labels, below);
  });
}

}  // namespace

std::string open_metrics(const std::vector<Measured>& daemons) {
  Writer out;
  out.family("bushd_up", "gauge", "1 while bushd-web is connected to the daemon");
  for (const Measured& daemon : daemons) {
    out.sample("", of_daemon(daemon), daemon.connected ? 1 : 0);
  }
  out.family("bushd_daemon_cpu_seconds", "counter", "Processor time of the daemon");
  for (const Measured& daemon : daemons) {
    if (daemon.cpu_s) out.sample("_total", of_daemon(daemon), *daemon.cpu_s);
  }
  tell_motors(out, daemons);
  tell_mcus(out, daemons);
  out.family("bushd_bus_open", "gauge", "1 while the serial port of the bus is open");
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    out.sample("", labels, bus.port_state == "open" ? 1 : 0);
  });
  out.family("bushd_bus_crc_errors", "counter", "Frames that the daemon found damaged");
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    out.sample("_total", labels, bus.crc_errors);
  });
  out.family("bushd_bus_line_bytes", "counter", "Bytes sent and received on the line");
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    out.sample("_total", labels, bus.line_bytes);
  });
  out.family("bushd_bus_line_bytes_per_second", "gauge",
             "Bytes that the line can carry in a second");
  each_bus(daemons, [&](const std::string& labels, const api::HealthSnapshot& bus) {
    out.sample("", labels, bus.line_bytes_per_s);
  });
  tell_latencies(out, daemons);
  return std::move(out).end();
}

}  // namespace bushweb
