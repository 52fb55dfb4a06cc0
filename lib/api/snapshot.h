// What clients see without asking for anything: state (moves with the motors), description (rarely
// changes) and health. State and description are per MCU, health per bus, so that each fits one
// packet.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "api/reply.h"
#include "api/words.h"
#include "base/fields.h"
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
  std::int64_t position_steps = 0;
  double user = 0;
  double dial = 0;
  std::int64_t target_steps = 0;
  double user_target = 0;
  double velocity_steps_per_s = 0;
  Activity activity = Activity::kResting;
  bool moving = false;
  bool enabled = false;
  bool input = false;
  std::string inputs{};
  Directions inhibited{};
  Trust trust = Trust::kKnown;
  std::string uncertain_reason{};
  std::optional<std::int64_t> heard_utime_us{};
  bool paused = false;
  bool held = false;
  std::string armed_by{};
  struct Line {
    double fraction = 0;
    std::int64_t left_us = 0;
    friend bool operator==(const Line&, const Line&) = default;
  };
  std::optional<Line> line{};

  static constexpr std::string_view kName = "motor";
  static constexpr std::string_view kMeaning = "What changes of one motor as it moves.";
  static void fields(auto& self, auto& visit) {
    const fields::If known{self.trust != Trust::kUnknown};
    bool on_line = self.line.has_value();
    Line line_now = self.line.value_or(Line{});
    visit("name", self.name);
    visit({"position_steps",
           "as its MCU reported last; while `trust` is \"unknown\" it says nothing, nor do the "
           "other positions and targets"},
          self.position_steps, known);
    visit({"user_position", kMotorUnit, "the same on the user's scale"}, self.user, known);
    visit({"dial_position", kMotorUnit, "the same on the dial"}, self.dial, known);
    visit({"target_steps",
           "where it will stand in the end, also after a stop; without a move of the daemon's "
           "where it is"},
          self.target_steps, known);
    visit({"user_target", kMotorUnit, "the same on the user's scale"}, self.user_target, known);
    visit({"velocity_steps_per_s", "signed, of the running step; 0 unless `activity` is \"move\""},
          self.velocity_steps_per_s);
    visit({"moving", "it makes steps, or is about to; not while it is armed"}, self.moving);
    visit({"activity",
           "\"rest\", \"move\", \"arming\": is to wait for the trigger, \"armed\": waits for it "
           "(its MCU has confirmed that), \"home\" (or waits for it), \"local\": moved by the "
           "inputs at its MCU, or by another master"},
          self.activity, fields::Word{activity_of});
    visit({"enabled", "drivers powered"}, self.enabled);
    visit({"input", "one of its switches is active"}, self.input);
    visit({"inputs",
           "active ones of its inputs, blanks between: \"positive\", \"negative\", \"home\", "
           "\"step\""},
          self.inputs);
    visit({"inhibited",
           "directions that a limit switch inhibits: \"\", \"positive\", \"negative\" or \"both\""},
          self.inhibited, fields::Word{directions_of});
    visit({"trust", "\"unknown\", \"known\", \"restored\", \"stale\" or \"uncertain\""}, self.trust,
          fields::Word{trust_of});
    visit({"uncertain_reason", "why it is not known; \"\" while it is"}, self.uncertain_reason);
    visit({"heard_utime_us",
           "while `trust` is \"stale\": when position_steps was heard, microseconds since 1970; "
           "else 0"},
          self.heard_utime_us, fields::NoneIs<std::int64_t>{0});
    visit({"paused", "it ramps down, or stands, on the way to its target"}, self.paused);
    visit({"held", "no motion begins"}, self.held);
    visit({"armed_by", "while it is \"arming\" or \"armed\": whose request that is; else \"\""},
          self.armed_by);
    visit({"on_line",
           "it moves on a line with others, or stands on the way; then the next two say something"},
          on_line);
    visit({"line_fraction", "share of the line that has been made, as reported last",
           fields::Range{0, 1}},
          line_now.fraction, fields::If{on_line});
    visit({"line_left_s", "time that the rest of it takes"}, line_now.left_us, InSeconds{on_line});
    visit.set(self.line, on_line ? std::optional(line_now) : std::nullopt);
  }
  friend bool operator==(const MotorState&, const MotorState&) = default;
};

struct StateSnapshot {
  std::string bus{};
  std::string mcu{};
  McuState state = McuState::kOffline;
  std::string detail{};
  std::string inputs{};
  std::string program{};
  std::int32_t boot = 0;
  std::int64_t tick = 0;
  std::vector<MotorState> motors{};

  static constexpr std::string_view kName = "mcu state";
  static constexpr std::string_view kMeaning =
      "One message per MCU, so that each fits one datagram: at once on change, 20 times a second "
      "while a motor moves (with more than 128 such MCUs positions come in turns, of 128 each "
      "time), "
      "else twice. The newest ones of the parts 0 .. parts-1 together are the "
      "whole. Of axes that are computed from motors positions are those of people, and steps count "
      "the last decimal that these are shown.";
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit({"mcu", "\"<bus>:<address>\"; of axes that are computed: \"<bus>:<first axis>\""},
          self.mcu);
    visit({"state", "OFFLINE, BUSY, READY, RUN, FAULT"}, self.state, fields::Word{mcu_state_of});
    visit({"detail", "cause of OFFLINE or FAULT, else \"\""}, self.detail);
    visit(
        {"inputs",
         "the MCU's that are active: of emergency, forward, reverse, trigger, with blanks between"},
        self.inputs);
    visit({"program",
           "that is under way, and where it is: \"scan runs, frame 3, without host\"; \"\": none"},
          self.program);
    visit({"boot_number", "0 until the MCU was heard"}, self.boot);
    visit({"tick", "bus tick of the report behind this message"}, self.tick);
    visit.list("motor_count", {"motors", "by output"}, self.motors);
  }
  friend bool operator==(const StateSnapshot&, const StateSnapshot&) = default;
};

// A scale and soft limits as they are told: the limits on both scales, for clients that only show
// them.
struct ToldScale {
  std::string unit{};
  std::string steps_per_unit{};
  bool negative = false;
  double offset = 0;
  std::int8_t precision = 0;
  bool soft_limits = false;
  units::SoftLimits dial{};
  units::SoftLimits user{};
  static void fields(auto& self, auto& visit) {
    visit({"unit", "\"steps\" of a motor without one"}, self.unit);
    visit({"steps_per_unit", "exact: \"320\" or \"1/3\""}, self.steps_per_unit);
    visit({"negative",
           "user position = offset - dial; otherwise offset + dial. dial = steps / steps_per_unit"},
          self.negative);
    visit({"offset", kMotorUnit, "of the user's scale"}, self.offset);
    visit({"precision", "decimals of positions for people", kDecimals}, self.precision);
    visit({"soft_limits", "it has some"}, self.soft_limits);
    const fields::If limited{self.soft_limits};
    visit({"dial_low", kMotorUnit}, self.dial.low, limited);
    visit({"dial_high", kMotorUnit}, self.dial.high, limited);
    visit({"user_low", kMotorUnit, "the same on the user's scale, low below high"}, self.user.low,
          limited);
    visit({"user_high", kMotorUnit}, self.user.high, limited);
  }
  bool is_good() const;
  units::Scale scale() const;
  std::optional<units::SoftLimits> limits() const;
};
ToldScale told_scale(const units::Scale& scale, const std::optional<units::SoftLimits>& limits);

struct MotorDescription {
  std::string name{};
  std::uint8_t output = 0;
  std::string group{};
  TableRef table{};
  std::string text{};
  units::Scale scale{};
  std::optional<units::SoftLimits> soft_limits{};

  static constexpr std::string_view kName = "motor description";
  static constexpr std::string_view kMeaning = "What rarely changes of one motor.";
  static void fields(auto& self, auto& visit) {
    ToldScale scale = told_scale(self.scale, self.soft_limits);
    visit("name", self.name);
    visit("output", self.output, fields::As<std::int16_t>{});
    visit("group", self.group);
    visit({"table", "in service, for the next move"}, self.table);
    visit({"description", "of the configuration; may be empty"}, self.text);
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
  std::int32_t address = 0;
  std::int64_t tick_ns = 0;
  StopMode emergency_stop = StopMode::kRamp;
  std::string port{};
  std::vector<MotorDescription> motors{};
  // Else axes that are computed from motors.
  bool is_mcu() const { return address != 0; }

  static constexpr std::string_view kName = "mcu description";
  static constexpr std::string_view kMeaning =
      "One message per MCU, on change and every three seconds. Parts as in mcu_state_t.";
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit("mcu", self.mcu);
    visit({"address", "0: axes that are computed from motors"}, self.address);
    visit("tick_ns", self.tick_ns);
    visit({"emergency_stop", "how its motors stop then: \"ramp\", \"immediate\" or \"disable\""},
          self.emergency_stop, fields::Word{stop_mode_of});
    visit({"port", "of the bus, that is open: of a pattern the one in use; \"\": none"}, self.port);
    visit.list("motor_count", {"motors", "by output"}, self.motors);
  }
  friend bool operator==(const Description&, const Description&) = default;
};

struct McuHealth {
  std::string mcu{};
  std::int32_t address = 0;
  std::string unique_id{};
  std::int32_t firmware_version = 0;
  std::int32_t boot = 0;
  std::string reset_cause{};
  std::int32_t current = 0;
  std::uint64_t crc_errors = 0;
  std::uint64_t rejected_frames = 0;
  std::uint64_t ramp_downs = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t repeats = 0;
  std::uint64_t missed_ticks = 0;
  std::uint64_t restarts = 0;
  std::optional<std::int32_t> low_water_ticks{};
  double rate_ppm = 0;
  double clock_offset_us = 0;
  bool two_masters = false;

  static constexpr std::string_view kName = "mcu health";
  static constexpr std::string_view kMeaning =
      "Counted since the daemon's start, over all boots of the MCU that it saw.";
  static void fields(auto& self, auto& visit) {
    visit({"mcu", "\"<bus>:<address>\""}, self.mcu);
    visit("address", self.address);
    visit({"unique_id", "16 hexadecimal digits; \"\" until the MCU was heard"}, self.unique_id);
    visit({"firmware_version", "0 until the MCU was heard"}, self.firmware_version);
    visit({"boot_number", "0 until the MCU was heard"}, self.boot);
    visit({"reset_cause",
           "of that boot: \"power-on\", \"external\", \"brown-out\", \"watchdog\"; \"\" if it is "
           "not known"},
          self.reset_cause);
    visit({"current", "of the supply, as read last: share of what the MCU can measure",
           fields::Range{0, 1023}},
          self.current);
    visit({"crc_errors", "frames that reached the MCU broken"}, self.crc_errors);
    visit({"rejected_frames", "valid ones that it could not use"}, self.rejected_frames);
    visit({"ramp_downs", "motors whose queue ran dry and that came to rest by their own table"},
          self.ramp_downs);
    visit({"timeouts", "requests that it did not answer"}, self.timeouts);
    visit({"repeats", "stream frames sent to it again"}, self.repeats);
    visit({"missed_ticks", "ticks that were sent to it and found missing"}, self.missed_ticks);
    visit({"restarts", "boots that the daemon saw, but the first"}, self.restarts);
    visit({"low_water_ticks",
           "the fewest ticks that a moving motor had queued, since the message before; -1: none "
           "moved"},
          self.low_water_ticks, fields::NegativeIsNone<std::int32_t>{});
    visit({"rate_ppm", "how much faster than its crystal it counts, to follow the bus"},
          self.rate_ppm);
    visit({"clock_offset_us",
           "by how much its last SYNC differed from that of the first MCU that is in step; of a "
           "serial port that makes pulses: by how much it was ahead of the slowest port of its "
           "last line"},
          self.clock_offset_us);
    visit({"two_masters", "it hears two of them"}, self.two_masters);
  }
  friend bool operator==(const McuHealth&, const McuHealth&) = default;
};

struct HealthSnapshot {
  struct Latency {
    std::int64_t below_us = 0;
    std::uint64_t answers = 0;

    static constexpr std::string_view kName = "latency bin";
    static constexpr std::string_view kMeaning = "Answers by the time that they took.";
    static void fields(auto& self, auto& visit) {
      visit({"below_us", "of the last bin the largest number of 64 bits"}, self.below_us,
            fields::If{self.below_us != INT64_MAX});
      visit({"answers", "below this bound and not below that of the bin before"}, self.answers);
    }
    friend bool operator==(const Latency&, const Latency&) = default;
  };
  std::string bus{};
  std::string port_state{};
  bool two_masters = false;
  std::uint64_t crc_errors = 0;
  std::uint64_t stray_frames = 0;
  std::int64_t recent_latency_us = 0;
  std::int64_t start_margin_us = 0;
  std::uint64_t line_bytes = 0;
  std::int64_t line_bytes_per_s = 0;
  std::vector<Latency> latency{};
  std::vector<McuHealth> mcus{};

  static constexpr std::string_view kName = "health";
  static constexpr std::string_view kMeaning =
      "One message per bus, once a second. `part` 0 .. parts-1 together are the whole.";
  static void fields(auto& self, auto& visit) {
    visit("bus", self.bus);
    visit({"port_state", "\"open\", or why it is not"}, self.port_state);
    visit({"two_masters", "another master was heard on this line within the last seconds"},
          self.two_masters);
    visit({"crc_errors", "frames that reached the daemon broken"}, self.crc_errors);
    visit({"stray_frames", "valid ones that nobody had been asked for"}, self.stray_frames);
    visit({"recent_latency_us", "of late: the largest, fading"}, self.recent_latency_us);
    visit({"start_margin_us",
           "left to the daemon when a motion of one motor begins, longer after missed starts; 0: a "
           "bus without MCU firmware"},
          self.start_margin_us);
    visit({"line_bytes", "sent and received on the line; 0: a bus without MCU firmware"},
          self.line_bytes);
    visit({"line_bytes_per_s", "that the line can carry"}, self.line_bytes_per_s);
    visit.list("latency_count",
               {"latency",
                "of the adapter, from when the bus has carried an answer's last byte to when the "
                "daemon had it; with rising bounds"},
               self.latency);
    visit.list("mcu_count", "mcus", self.mcus);
  }
  friend bool operator==(const HealthSnapshot&, const HealthSnapshot&) = default;
};

struct CamacLam {
  std::int32_t crate = 0;
  std::uint32_t raised = 0;
  std::uint32_t requests = 0;
  bool demand = false;

  static constexpr std::string_view kName = "camac lam";
  static constexpr std::string_view kMeaning =
      "Stations of a CAMAC crate have raised L. Told once, on the control socket with the state; "
      "N30 A0 F0 reads the "
      "requests again.";
  static void fields(auto& self, auto& visit) {
    visit("crate", self.crate);
    visit({"raised", "bit n - 1: station n, just now"}, self.raised);
    visit({"requests", "all that raise L"}, self.requests);
    visit({"demand", "the crate's demand is enabled"}, self.demand);
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
