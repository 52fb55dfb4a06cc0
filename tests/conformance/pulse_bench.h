// A serial port that makes pulses (lib/heritage/serial_pulse) as a controller of one motor, against
// the drive that bushsim plays (sim/pulse_drive.h), in simulated time: no daemon between them. What
// is judged are the levels on the line; delays come from lists of codes here.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "heritage/serial_pulse/master.h"
#include "motion/axis.h"
#include "sim/pulse_drive.h"

namespace bushd::test {

// Kinds of ports that must all do the same.
struct PortTarget {
  std::string name;
  bool any_rate = true;
  std::uint32_t base = 0;      // of the divisors of an UART; 0: it makes what it is asked
  bool tells_empty = true;     // otherwise it does not tell what its adapter still has, either
  std::int64_t packet_us = 0;  // its adapter passes bytes on once in that time; 0: at once
  friend void PrintTo(const PortTarget& target, std::ostream* out) { *out << target.name; }
};
std::vector<PortTarget> port_targets();

class PulseBench : private link::TickSource, private sim::EdgeSink {
 public:
  static constexpr std::int64_t kUnitNs = 40'000;
  static constexpr std::int64_t kCruise = 10;  // 2500 Hz
  static constexpr std::int64_t kMostAheadUs = 20'000;
  static constexpr std::int64_t kDirectionNs = 1'000'000;

  // Inputs: CD home, DSR positive limit, CTS negative limit.
  explicit PulseBench(const PortTarget& target, bool limit_immediate = false);
  ~PulseBench() override;  // nothing was changed amid bytes, and no direction near a step

  void run_for(double seconds);
  void pause(double seconds);  // nobody runs the controller; the drive goes on
  // Moves by so many steps; the caller runs on.
  void begin(std::int64_t steps, std::uint16_t shortest_delay = 0);
  void stop();
  void aim(std::int64_t target, std::uint16_t shortest_delay = 0);
  // Until it stands, and has said so.
  void finish(double limit_s = 60);
  void move(std::int64_t steps, std::uint16_t shortest_delay = 0) {
    begin(steps, shortest_delay);
    finish();
  }
  bushd_homing home(int direction, double limit_s = 200);
  void give_up_homing();
  void emergency_stop(bushd_stop_mode mode);
  void lose_port();
  void open_port();
  void stall(bool stalled);  // the driver passes nothing on, and says so if it can
  // The daemon starts anew at the same port.
  void restart();
  void set_position(std::int32_t steps);
  void clear_faults();

  sim::PulseDrive& drive() { return drive_; }
  serial_pulse::SerialPulseMaster& master() { return *master_; }
  const bushd_report& report() const { return master_->view({0}).report; }
  std::int64_t counted() const { return report().motor[0].position_steps; }
  const std::vector<link::Event>& events() const { return events_; }
  template <typename T>
  std::size_t count_of() const {
    std::size_t count = 0;
    for (const link::Event& event : events_) count += std::holds_alternative<T>(event) ? 1 : 0;
    return count;
  }

  // All steps from the `from`th on are one run: none before A(j-1), D(N-j) and the cruise delay, or
  // `shortest_delay`, after the one before. Times are whole ns: exact to one.
  void expect_run(std::size_t from, std::int64_t shortest_delay = 0, bool stopped = false);
  void expect_count() { EXPECT_EQ(counted(), drive_.position_steps() - origin_); }
  // The most steps that may be under way at full speed: 20 ms of bytes, which is 50, and one more
  // byte.
  static constexpr std::int64_t kUnderWay = 55;
  // Those of a ramp-down from full speed, the running step and what up to two ticks more bring.
  static constexpr std::int64_t kRampDown = 40 + 1 + 14;

 private:
  std::size_t most_left_out(std::size_t to_go) const;
  std::uint16_t render(link::McuIndex, std::uint8_t, link::Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override {
    return axis_.render(first, count, out, stride);
  }
  std::optional<RunSegment> run_at(link::McuIndex, std::uint8_t, link::Tick, unsigned) override {
    return std::nullopt;
  }
  std::optional<bushd_run> plan_at(link::McuIndex, std::uint8_t, link::Tick at) override {
    return axis_.plan_at(at);
  }
  link::Tick end_tick(link::McuIndex, std::uint8_t) override { return axis_.end_tick(); }
  void edge(const sim::Edge& edge) override;
  void settled(sim::TimeNs) override {}

  void start_master();
  void run_until(std::int64_t limit_us);
  void carry_out(const link::PulseOrder& order);
  void pass_on();
  void take_report();
  void replan();

  PortTarget target_;
  std::vector<std::uint16_t> accel_;
  std::vector<std::uint16_t> decel_;
  bushd_table table_{};
  bool limit_immediate_;
  motion::Axis axis_;
  sim::PulseDrive drive_;
  std::unique_ptr<serial_pulse::SerialPulseMaster> master_;
  std::uint16_t boot_ = 0;
  std::vector<link::Event> events_;
  std::int64_t now_us_ = 0;
  std::int64_t origin_ = 0;  // of the drive, where 0 is counted
  bool open_ = false;
  bool stalled_ = false;
  std::vector<std::uint8_t> held_;
  std::optional<sim::TimeNs> last_step_ns_;
  std::optional<sim::TimeNs> direction_ns_;
};

}  // namespace bushd::test
