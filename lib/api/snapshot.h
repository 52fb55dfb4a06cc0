// What clients see without asking for anything: state (moves with the motors), description (rarely
// changes) and health. State and description are per MCU, health per bus, so that each fits one
// packet.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "api/reply.h"
#include "api/words.h"
#include "base/ids.h"
#include "base/units/coordinates.h"

namespace bushd::api {

// Microseconds as seconds, where they mean something.
struct InSeconds : fields::If {
  using If::If;
  static double told(std::int64_t us) { return static_cast<double>(us) * 1e-6; }
  // What hostile numbers make of it need only be some number.
  static bool taken(double told, std::int64_t& us) {
    us = std::isnan(told) ? 0 : std::llround(std::clamp(told, 0.0, 1e9) * 1e6);
    return true;
  }
};

struct MotorState {
  std::string name{};
  std::int64_t position_steps = 0;  // as its MCU reported last; no number while Trust::kUnknown
  double user = 0;                  // the same for people (units/coordinates.h)
  double dial = 0;
  // Where it will stand in the end, also after a stop; without a move of the daemon's where it is.
  std::int64_t target_steps = 0;
  double user_target = 0;
  double velocity_steps_per_s = 0;  // signed, of the running step; 0 unless Activity::kMoving
  Activity activity = Activity::kResting;
  bool moving = false;     // it makes steps, or is about to; not while armed
  bool enabled = false;    // drivers powered
  bool input = false;      // one of its switches is active
  std::string inputs{};    // active ones: of positive, negative, home, step, blanks between
  Directions inhibited{};  // by its limit switches
  Trust trust = Trust::kKnown;
  std::string uncertain_reason{};  // why it is not known; "" while it is
  // When the position was heard, microseconds since 1970, if Trust::kStale.
  std::optional<std::int64_t> heard_utime_us{};
  bool paused = false;     // it ramps down, or stands, on the way to its target
  bool held = false;       // no motion begins
  std::string armed_by{};  // whose request it is to wait for the trigger by; "": it does not
  // While it moves on a line: the share of the line's run that has been made, as reported last, and
  // the time that the rest of it takes.
  struct Line {
    double fraction = 0;
    std::int64_t left_us = 0;
    friend bool operator==(const Line&, const Line&) = default;
  };
  std::optional<Line> line{};
  static void fields(auto& self, auto& visit) {
    const fields::If known{self.trust != Trust::kUnknown};
    bool on_line = self.line.has_value();
    Line line_now = self.line.value_or(Line{});
    visit("name", self.name);
    visit("position_steps", self.position_steps, known);
    visit("user_position", self.user, known);
    visit("dial_position", self.dial, known);
    visit("target_steps", self.target_steps, known);
    visit("user_target", self.user_target, known);
    visit("velocity_steps_per_s", self.velocity_steps_per_s);
    visit("moving", self.moving);
    visit("activity", self.activity, fields::Word{activity_of});
    visit("enabled", self.enabled);
    visit("input", self.input);
    visit("inputs", self.inputs);
    visit("inhibited", self.inhibited, fields::Word{directions_of});
    visit("trust", self.trust, fields::Word{trust_of});
    visit("uncertain_reason", self.uncertain_reason);
    visit("heard_utime_us", self.heard_utime_us, fields::NoneIs<std::int64_t>{0});
    visit("paused", self.paused);
    visit("held", self.held);
    visit("armed_by", self.armed_by);
    visit("on_line", on_line);
    visit("line_fraction", line_now.fraction, fields::If{on_line});
    visit("line_left_s", line_now.left_us, InSeconds{on_line});
    visit.set(self.line, on_line ? std::optional(line_now) : std::nullopt);
  }
  friend bool operator==(const MotorState&, const MotorState&) = default;
};

// One MCU and its motors. Or axes that are computed from motors: their positions are those of
// `user`, and their steps count the last decimal that people are shown.
struct StateSnapshot {
  std::string bus{};
  std::string mcu{};  // "<bus>:<address>", or "<bus>:<name of the first axis>"
  McuState state = McuState::kOffline;
  std::string detail{};   // cause of kOffline or kFault, else ""
  std::string inputs{};   // active ones: of emergency, forward, reverse, trigger, blanks between
  std::string program{};  // under way, and where: "scan runs, frame 3, without host"; "": none
  std::int32_t boot = 0;  // its boot number; 0 until it was heard
  std::int64_t tick = 0;  // bus tick of the report behind this
  std::vector<MotorState> motors{};  // by output
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit("mcu", self.mcu);
    visit("state", self.state, fields::Word{mcu_state_of});
    visit("detail", self.detail);
    visit("inputs", self.inputs);
    visit("program", self.program);
    visit("boot_number", self.boot);
    visit("tick", self.tick);
    visit.list("motor_count", "motors", self.motors);
  }
  friend bool operator==(const StateSnapshot&, const StateSnapshot&) = default;
};

// A scale and soft limits as they are told: the limits on both scales, for clients that only show
// them.
struct ToldScale {
  std::string unit{};
  std::string steps_per_unit{};  // exact: "320" or "1/3"
  bool negative = false;
  double offset = 0;
  std::int8_t precision = 0;
  bool soft_limits = false;
  units::SoftLimits dial{};
  units::SoftLimits user{};
  static void fields(auto& self, auto& visit) {
    visit("unit", self.unit);
    visit("steps_per_unit", self.steps_per_unit);
    visit("negative", self.negative);
    visit("offset", self.offset);
    visit("precision", self.precision);
    visit("soft_limits", self.soft_limits);
    const fields::If limited{self.soft_limits};
    visit("dial_low", self.dial.low, limited);
    visit("dial_high", self.dial.high, limited);
    visit("user_low", self.user.low, limited);
    visit("user_high", self.user.high, limited);
  }
  bool is_good() const;
  units::Scale scale() const;  // of one that is not good: any
  std::optional<units::SoftLimits> limits() const;
};
ToldScale told_scale(const units::Scale& scale, const std::optional<units::SoftLimits>& limits);

struct MotorDescription {
  std::string name{};
  std::uint8_t output = 0;
  std::string group{};
  TableRef table{};      // in service, for the next move
  std::string text{};    // what people call it; may be empty
  units::Scale scale{};  // with the number of decimals
  std::optional<units::SoftLimits> soft_limits{};
  static void fields(auto& self, auto& visit) {
    ToldScale scale = told_scale(self.scale, self.soft_limits);
    visit("name", self.name);
    visit("output", self.output, fields::As<std::int16_t>{});
    visit("group", self.group);
    visit("table", self.table);
    visit("description", self.text);
    ToldScale::fields(scale, visit);
    if constexpr (std::remove_cvref_t<decltype(visit)>::kReads) {
      visit.require(scale.is_good());
      visit.set(self.scale, scale.scale());
      visit.set(self.soft_limits, scale.limits());
    }
  }
  friend bool operator==(const MotorDescription&, const MotorDescription&) = default;
};

struct Description {
  std::string bus{};
  std::string mcu{};
  std::int32_t address = 0;  // 0: axes that are computed from motors
  std::int64_t tick_ns = 0;
  StopMode emergency_stop = StopMode::kRamp;
  std::string port{};                      // of the bus, that is open; "": none
  std::vector<MotorDescription> motors{};  // by output
  // Else axes that are computed from motors.
  bool is_mcu() const { return address != 0; }
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit("mcu", self.mcu);
    visit("address", self.address);
    visit("tick_ns", self.tick_ns);
    visit("emergency_stop", self.emergency_stop, fields::Word{stop_mode_of});
    visit("port", self.port);
    visit.list("motor_count", "motors", self.motors);
  }
  friend bool operator==(const Description&, const Description&) = default;
};

// Counted since the daemon's start, over all boots of the MCU that it saw.
struct McuHealth {
  std::string mcu{};
  std::int32_t address = 0;
  std::string unique_id{};  // 16 hexadecimal digits; "" until the MCU was heard
  std::int32_t firmware_version = 0;
  std::int32_t boot = 0;
  std::string reset_cause{};  // "power-on", "external", "brown-out", "watchdog"; "" if unknown
  std::int32_t current = 0;   // of the supply, as read last: 0..1023 of what the MCU can measure
  std::uint64_t crc_errors = 0;
  std::uint64_t rejected_frames = 0;
  std::uint64_t ramp_downs = 0;  // motors that ran dry and came to rest by their own table
  std::uint64_t timeouts = 0;
  std::uint64_t repeats = 0;
  std::uint64_t missed_ticks = 0;
  std::uint64_t restarts = 0;
  std::optional<std::int32_t> low_water_ticks{};  // since the snapshot before; none: nothing moved
  double rate_ppm = 0;
  double clock_offset_us = 0;
  bool two_masters = false;
  static void fields(auto& self, auto& visit) {
    visit("mcu", self.mcu);
    visit("address", self.address);
    visit("unique_id", self.unique_id);
    visit("firmware_version", self.firmware_version);
    visit("boot_number", self.boot);
    visit("reset_cause", self.reset_cause);
    visit("current", self.current);
    visit("crc_errors", self.crc_errors);
    visit("rejected_frames", self.rejected_frames);
    visit("ramp_downs", self.ramp_downs);
    visit("timeouts", self.timeouts);
    visit("repeats", self.repeats);
    visit("missed_ticks", self.missed_ticks);
    visit("restarts", self.restarts);
    visit("low_water_ticks", self.low_water_ticks, fields::NegativeIsNone<std::int32_t>{});
    visit("rate_ppm", self.rate_ppm);
    visit("clock_offset_us", self.clock_offset_us);
    visit("two_masters", self.two_masters);
  }
};

// One bus and its MCUs.
struct HealthSnapshot {
  struct Latency {
    std::int64_t below_us = 0;  // the last one is INT64_MAX
    std::uint64_t answers = 0;  // below this and not below the one before
    static void fields(auto& self, auto& visit) {
      visit("below_us", self.below_us, fields::If{self.below_us != INT64_MAX});
      visit("answers", self.answers);
    }
  };
  std::string bus{};
  std::string port_state{};  // "open", or why it is not
  bool two_masters = false;
  std::uint64_t crc_errors = 0;
  std::uint64_t stray_frames = 0;
  std::int64_t recent_latency_us = 0;
  std::int64_t start_margin_us = 0;   // left to the daemon at a start; 0: a bus without MCUs
  std::uint64_t line_bytes = 0;       // sent and received; 0: a bus without MCUs
  std::int64_t line_bytes_per_s = 0;  // that its line can carry
  std::vector<Latency> latency{};
  std::vector<McuHealth> mcus{};
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit("port_state", self.port_state);
    visit("two_masters", self.two_masters);
    visit("crc_errors", self.crc_errors);
    visit("stray_frames", self.stray_frames);
    visit("recent_latency_us", self.recent_latency_us);
    visit("start_margin_us", self.start_margin_us);
    visit("line_bytes", self.line_bytes);
    visit("line_bytes_per_s", self.line_bytes_per_s);
    visit.list("latency_count", "latency", self.latency);
    visit.list("mcu_count", "mcus", self.mcus);
  }
};

// Stations of a CAMAC crate have raised L.
struct CamacLam {
  std::int32_t crate = 0;
  std::uint32_t raised = 0;    // bit n - 1: station n, just now
  std::uint32_t requests = 0;  // all that raise it
  bool demand = false;         // somebody has enabled the crate's demand
  static void fields(auto& self, auto& visit) {
    visit("crate", self.crate);
    visit("raised", self.raised);
    visit("requests", self.requests);
    visit("demand", self.demand);
  }
  friend bool operator==(const CamacLam&, const CamacLam&) = default;
};

// Where the core publishes to. Called from within the core; must not call back into it.
class Publisher {
 public:
  virtual ~Publisher() = default;
  // `mcu` and `bus` number the snapshots of one kind from 0: each one replaces the one
  // before of its number. Numbers beyond those of MCUs are of computed axes.
  virtual void publish(McuId mcu, const StateSnapshot& state) = 0;
  virtual void publish(McuId mcu, const Description& description) = 0;
  virtual void publish(BusId bus, const HealthSnapshot& health) = 0;
  // An event, not kept for later.
  virtual void publish_lam(const CamacLam& /*lam*/) {}
};

}  // namespace bushd::api
