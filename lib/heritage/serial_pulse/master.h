// A serial port as the controller of one motor: TXD makes the pulses, DTR or RTS the direction,
// modem lines are the switches. It stands in for an MCU (docs/decisions/0043-bus-kinds.md): it
// makes runs of the motor's table, homes, keeps the position, ramps down at limits and in an
// emergency.
//
// Steps are bytes (pattern.h), chosen one by one (planner.h) and written so that at most 20 ms of
// them are under way; one byte, if that takes longer. Nothing is ever taken back: whatever
// ends a run sends other bytes behind those. So every step is counted: it has been made when its
// byte has left.
//
// When a byte has left is not told by drivers; it is computed from its rate, and at the end of a
// run, before a change of rate and before a change of direction, made sure of (drained()). If the
// port is lost, what had not left for sure is told as steps that may be missing.
//
// Ticks follow the motor, as docs/decisions/0043-bus-kinds.md says: the reported one is the last at
// whose beginning the plan had made no more steps than have left.
//
// On a line with other ports (link/line_pace.h) it makes its motor's part of the line's run, no
// step before the line's time, and its ticks are not ahead of that (line.cpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/rs485/bus_master.h"
#include "bus/rs485/pulse_port.h"
#include "bus/rs485/tick_source.h"
#include "heritage/serial_pulse/planner.h"

namespace bushd::serial_pulse {

// Not before it.
constexpr std::int64_t us_of(std::int64_t ns) {
  return (ns + 999) / 1000;
}

class SerialPulseMaster final : public link::BusMaster,
                                public link::PulsePort,
                                public link::Homing,
                                public link::TableRuns,
                                public link::PacedLines,
                                private link::LinePort {
 public:
  // Bytes under way, at most: where one takes nearly as long or longer, it and as much before it.
  static constexpr std::int64_t kMostAheadUs = 20'000;
  static constexpr std::int64_t kSpareUs = 5'000;
  // What an adapter that cannot be asked has leaves so much later, at most, than it would at once.
  static constexpr std::int64_t kUnseenUs = 20'000;
  // The direction is set as long before a step, and kept as long behind it.
  static constexpr std::int64_t kDirectionUs = 1'000;
  // Nothing was heard of the port for so long: this program stood still.
  static constexpr std::int64_t kStillUs = 100'000;
  // A limit is active until its contact has been open for as long: it bounces.
  static constexpr std::int64_t kReleaseUs = 100'000;

  // One MCU with one motor, at output 0. `source` outlives it. `unique_id`: of the port, so that a
  // kept position is known again.
  SerialPulseMaster(link::BusSetup setup, link::TickSource& source, std::uint64_t unique_id);

  link::Offers offers() override {
    return {.pulse_port = this, .homing = this, .table_runs = this, .paced_lines = this};
  }

  void port_opened(std::int64_t now_us) override;
  void port_lost(std::int64_t now_us, const std::string& cause) override;
  void receive(std::int64_t, std::span<const std::uint8_t>) override {}  // RXD is not connected
  std::span<const std::uint8_t> step(std::int64_t now_us) override;
  const link::PulseOrder* pulse_order() const override { return fresh_ ? &*order_ : nullptr; }
  void pulse_status(std::int64_t now_us, const link::PulseStatus& status) override;
  std::int64_t next_wake_us() const override;
  std::vector<link::Event> take_events() override;

  const link::McuView& view(link::McuIndex) const override { return view_; }
  bool time_known() const override { return true; }
  link::Tick tick_at(std::int64_t now_us) const override;
  const link::McuHealth& health(link::McuIndex) const override { return health_; }
  const link::BusHealth& bus_health() const override { return bus_health_; }
  bool busy(link::McuIndex) const override { return requests_open_; }

  link::Tick earliest_start(std::int64_t now_us, link::McuIndex, std::uint8_t) const override;
  link::Tick earliest_replace(std::int64_t now_us,
                              std::span<const link::ToReplace> together) const override;
  link::Tick earliest_retarget(std::int64_t now_us, std::span<const link::ToReplace> together,
                               link::Tick start) const override;
  void begin(link::McuIndex, std::uint8_t, link::Tick start) override;
  void begin_in_pace(link::McuIndex, std::uint8_t, link::Tick start,
                     link::LinePace::Place place) override;
  void begin_table_run(link::McuIndex mcu, std::uint8_t motor, link::Tick start,
                       link::TableRun) override {
    begin(mcu, motor, start);
  }
  void replace(link::McuIndex, std::uint16_t, link::Tick first) override;
  void drop(link::McuIndex, std::uint8_t) override;
  void emergency_stop(bushd_stop_mode mode) override;
  void bind_to_stop(link::McuIndex, bushd_stop_mode mode) override { emergency_stop(mode); }

  void reconfigure(link::McuIndex, link::McuSetup setup) override;
  void control(link::McuIndex, std::uint8_t actions) override;
  void set_position(link::McuIndex, std::uint8_t, std::int32_t position_steps) override;
  void home(link::McuIndex, const bushd_home& message) override;

  // Pauses of the line amid bytes: the adapter made them, or the daemon was late.
  struct Pauses {
    std::int64_t bytes_us = 0;   // what the bytes take by their rates
    std::int64_t pauses_us = 0;  // and what they took beyond that
    std::int64_t longest_us = 0;
  };
  const Pauses& pauses() const { return pauses_; }

 private:
  struct Sent {
    std::int64_t gone_ns;  // when it has left, by its rate
    std::uint8_t steps;
    std::int64_t takes_ns;
    std::int64_t last_step_ns;  // behind its first one
    // On a line: times of its run at which the first and the last of them are due.
    std::int64_t first_ns;
    std::int64_t last_ns;
    // When it has left at the latest, by its rate, since the driver has passed it on.
    std::optional<std::int64_t> passed_free_ns{};
  };
  // Steps to be made. `ahead` is ahead of `by_ticks` by what is under way.
  struct Run {
    Steps ahead;
    Ticks by_ticks;
    link::Tick start;  // of its first tick
    link::Tick tick;   // of by_ticks
    bool planned;      // the source's, else of its own: homing, or a ramp-down
    struct Change {
      link::Tick at;
      Ticks plan;  // from there on
    };
    std::optional<Change> change{};  // that by_ticks has not come to
    int direction = 1;
    std::int64_t from_steps = 0;
    std::int64_t not_before_us = 0;  // its next byte
    std::int64_t hold_us = 0;        // from when the last byte has left for sure to the next one
    std::uint32_t written = 0;
    std::uint32_t gone = 0;
    bool limited = false;  // a limit ends it
    bool on_line = false;
    std::optional<link::LinePace::Place> pace{};  // of a line, as long as it is planned
    std::int64_t left_ns = 0;   // of a line: time of the run of the last step that has left
    std::uint64_t kept_ns = 0;  // of a line: by the last byte, from its last step to its end
    bool slow = false;  // of homing: a byte is written when the one before it has left, and looked
  };
  struct Homing {
    bushd_home message;
    bushd_homing stage = BUSHD_HOMING_FAST;
    unsigned readings = 0;  // in a row
    std::int64_t read_us = 0;
    bool meets_limit = false;
    bool turned = false;
    bool stopped = false;  // on request
  };

  const bushd_table& table() const;
  std::int64_t us_per_ticks(link::Tick ticks) const;
  link::Tick clock(std::int64_t now_us) const;
  bool reads(std::uint8_t number) const;
  bushd_motor_inputs numbers() const;
  bool at_limit(int direction) const;
  bool forbidden(int direction) const;
  bool at_home() const { return reads(numbers().home); }

  // What has left.
  void count_gone(std::int64_t now_us);
  void follow_queue();
  void follow_passed_on();
  std::int64_t drained_us() const;
  bool drained(std::int64_t now_us) const;
  void wait_until_drained(std::int64_t now_us);
  std::uint32_t unsure_steps() const;

  // Runs.
  void begin_run(std::int64_t now_us, const link::MotorPlan& plan, link::Tick start, bool planned);
  void plan_rates(const link::MotorPlan& plan);
  void advance_ticks(std::int64_t now_us, bool to_the_end);
  void leave_plan(std::int64_t now_us, bool immediately);
  void ramp_down(bool immediately);
  void end_run(std::int64_t now_us);
  void watch_limits(std::int64_t now_us);
  void write(std::int64_t now_us, link::PulseOrder& order);
  bool may_write(std::int64_t now_us, link::PulseOrder& order);
  bool write_byte(std::int64_t now_us, link::PulseOrder& order);

  // line.cpp
  std::optional<link::MotorPlan> plan_from(link::Tick first);
  link::Tick line_clock(std::int64_t now_us) const;
  bool line_is_over(std::int64_t now_us);
  void tell_line(std::int64_t now_us);
  bool waits_for_line(std::int64_t now_us);
  void keep_delay_of(const Steps& ahead);
  std::int64_t hold_us_of(std::uint64_t delay_ns, std::uint64_t kept_ns) const;
  link::RunProgress progress_at(std::int64_t now_ns) const override;
  void measure_line(std::int64_t now_us);
  void tell_note();

  // homing.cpp
  void follow_homing(std::int64_t now_us);
  void follow_fast(std::int64_t now_us);
  void follow_slow(std::int64_t now_us);
  void begin_fast(std::int64_t now_us, int direction);
  void begin_slow(std::int64_t now_us, bushd_homing stage, int direction);
  void end_homing(std::int64_t now_us, bushd_homing how);
  bool looked(std::int64_t now_us);
  bool is_sure(std::int64_t now_us, bool as_wanted);

  void identify();
  void measure_pauses();
  void add_pause(std::int64_t us);
  void report(std::int64_t now_us);
  void wake_at(std::int64_t us) { wake_us_ = std::min(wake_us_, us); }
  void ask_at(std::int64_t us) { ask_us_ = std::min(ask_us_, us); }

  link::BusSetup setup_;
  link::TickSource& source_;
  link::McuView view_;
  link::McuHealth health_;
  link::BusHealth bus_health_;
  std::vector<link::Event> events_;
  Pauses pauses_;
  std::string pauses_note_;
  std::string line_note_;                 // of the last one
  std::optional<std::int64_t> burst_us_;  // bytes have been written since then, without a rest

  bool open_ = false;
  std::optional<link::PulseOrder> order_;  // not answered yet
  bool waits_ = false;                     // for its answer
  bool fresh_ = false;                     // it is of the last step
  std::optional<link::PulseStatus> status_;
  std::int64_t status_us_ = 0;
  std::int64_t direction_due_us_ = 0;  // when it may be ordered again
  std::int64_t direction_us_ = 0;      // when the direction was seen as it is
  std::int64_t wake_us_ = 0;
  std::int64_t ask_us_ = 0;  // when the port is to be asked, whether there is an order or not
  std::int64_t report_due_us_ = 0;
  std::array<std::int64_t, 2> limit_us_{INT64_MIN / 2, INT64_MIN / 2};  // seen last; [1]: positive
  std::int64_t now_us_ = 0;  // of the last call that had it

  Planner planner_;
  std::map<std::uint32_t, std::uint32_t> made_;  // of rates ordered
  std::uint32_t asked_baud_ = 0;
  std::deque<Sent> sent_;          // on their way, by their rates
  std::deque<Sent> recent_;        // of late, and not known for sure to have left
  std::int64_t line_free_ns_ = 0;  // when all have left, by their rates
  // At the latest, by their rates, of what the driver has passed on.
  std::int64_t passed_free_ns_ = 0;

  link::Tick base_tick_ = 0;  // at base_us_; while a planned run is under way ticks follow that
  std::int64_t base_us_ = 0;
  std::optional<Run> run_;
  std::optional<Homing> homing_;
  bushd_table slow_{};  // of the slow stages of homing: a single code
  bushd_homing last_homing_ = BUSHD_HOMING_NONE;
  bool homed_ = false;
  std::int64_t position_ = 0;  // at rest
  std::uint8_t faults_ = 0;
  bool requests_open_ = false;
};

}  // namespace bushd::serial_pulse
