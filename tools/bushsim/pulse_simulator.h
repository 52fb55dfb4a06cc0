// The drive of one motor behind a serial port (sim/pulse_drive.h): a pty whose bytes are steps at
// the baud rate that the other side has set, and its modem lines at a socket beside it
// (serial/line_socket.h). Paced to the clock on the wall.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "descriptor.h"
#include "pty.h"
#include "sim/pulse_drive.h"
#include "sim/vcd.h"
#include "simulator.h"
#include "waiter.h"

namespace bushsim {

class PulseSimulator {
 public:
  // As Simulator::create. Of its options, switches are those of the motor 1.0; inputs 0 to 3 are
  // CD, DSR, CTS and RI.
  static bushd::Result<std::unique_ptr<PulseSimulator>> create(const Options& options);
  ~PulseSimulator();

  // Until a signal ends it. SIGUSR1 takes the adapter away, SIGUSR2 plugs it in again.
  bushd::Result<void> run();
  std::string summary() const;

 private:
  PulseSimulator(const Options& options, Waiter waiter,
                 std::unique_ptr<bushd::sim::VcdWriter> trace);
  bushd::Result<void> plug_in();
  void unplug();
  bushd::Result<void> take_signals();
  bushd::Result<void> take_bytes();
  void take_client();
  void take_orders();
  bushd::Result<void> loop();
  bushd::sim::TimeNs now_ns() const;

  Waiter waiter_;
  std::vector<std::string> links_;
  std::size_t links_used_ = 0;
  std::unique_ptr<bushd::sim::VcdWriter> trace_;
  bushd::sim::PulseDrive drive_;
  std::optional<Pty> pty_;  // none: unplugged
  std::string socket_path_;
  Descriptor listener_;
  Descriptor client_;
  std::uint64_t taken_ = 0;    // bytes since the client was connected
  std::int64_t start_ns_ = 0;  // CLOCK_MONOTONIC at time 0
  bool positive_off_ = false;  // its direction line is off in the positive direction
  bool ended_ = false;
};

}  // namespace bushsim
