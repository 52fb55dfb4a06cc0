// The drive of one motor behind a serial port: bytes on TXD are steps, by the levels on the line
// alone (8N1, each fall is a step; STEP is the line inverted, as an opto-coupler does), a modem
// line is the direction, others are switches. It shares no code with what chooses the bytes.
//
// The port is one whose driver has a queue, and sends byte after byte at the rate that it has been
// set to. What must not happen is counted: a rate or a direction that changes amid bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "sim/edge.h"
#include "sim/switch.h"

namespace bushd::sim {

class PulseDrive {
 public:
  // `sink` may be null; edges are those of `mcu`, output 0.
  explicit PulseDrive(EdgeSink* sink, std::size_t mcu = 0) : sink_(sink), mcu_(mcu) {}

  // `line`: 0 CD, 1 DSR, 2 CTS, 3 RI.
  void attach_switch(std::uint8_t line, const SwitchOptions& options);
  // By hand, whatever switches say.
  void set_lines(std::uint8_t lines) { by_hand_ = lines; }

  void set_baud(TimeNs now_ns, std::uint32_t baud);
  void set_direction(TimeNs now_ns, bool positive);
  void send(TimeNs now_ns, std::span<const std::uint8_t> bytes);
  // The adapter loses its power: what has not left is lost.
  void break_off(TimeNs now_ns);
  void advance_to(TimeNs now_ns);

  // What is so now, as advanced to.
  std::size_t queued() const { return ends_ns_.size(); }  // bytes that have not left
  std::uint8_t lines();
  bool positive() const { return positive_; }
  std::uint32_t baud() const { return baud_; }
  TimeNs line_free_ns() const { return line_free_ns_; }

  std::int64_t position_steps() const { return position_; }
  std::uint64_t steps() const { return steps_; }
  std::uint64_t faults() const { return faults_; }
  // When each step was made, ns.
  const std::vector<TimeNs>& step_times_ns() const { return step_times_; }
  bool keeps_steps = true;  // for step_times_ns()

 private:
  struct Level {
    TimeNs time_ns;
    bool step;  // of STEP
  };
  struct AtLine {
    std::uint8_t line;
    Switch what;
  };
  void byte(TimeNs from_ns, std::uint8_t value);

  EdgeSink* sink_;
  std::size_t mcu_;
  std::vector<AtLine> switches_;
  std::uint8_t by_hand_ = 0;
  std::uint32_t baud_ = 9600;
  bool positive_ = false;
  TimeNs now_ns_ = 0;
  TimeNs line_free_ns_ = 0;
  std::deque<Level> levels_;    // to come
  std::deque<TimeNs> ends_ns_;  // of bytes
  std::int64_t position_ = 0;
  std::uint64_t steps_ = 0;
  std::uint64_t faults_ = 0;
  std::vector<TimeNs> step_times_;
};

}  // namespace bushd::sim
