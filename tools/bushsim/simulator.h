// The virtual bus behind a pty, paced to the clock on the wall.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adapter.h"
#include "base/result.h"
#include "descriptor.h"
#include "pty.h"
#include "setup.h"
#include "sim/bus.h"
#include "sim/vcd.h"
#include "typed_keys.h"
#include "waiter.h"

namespace bushsim {

struct Options {
  Setup setup;
  Images images;
  std::vector<SwitchAt> switches;
  std::vector<std::string> links;  // at least one: the port's names, each time it is plugged in
  std::string trace;               // empty: none
  std::uint16_t boot_number = 1;
  bool keep = false;                    // virtual MCUs keep over resets what those with flash do
  std::optional<std::uint8_t> console;  // what is typed is pressed at this MCU (press)
  AdapterOptions adapter;
};

class Simulator {
 public:
  // Makes all that can fail: pty, link, trace. Takes the signals of Waiter.
  static bushd::Result<std::unique_ptr<Simulator>> create(const Options& options);

  // Until a signal ends it. SIGUSR1 takes the serial adapter away, SIGUSR2 plugs it in again; the
  // MCUs live on. SIGRTMIN makes their trigger inputs active, or inactive if they are. One
  // thread.
  bushd::Result<void> run();

  // What was done, for people: a line per MCU and one for the line.
  std::string summary() const;

 private:
  Simulator(const Options& options, Waiter waiter, Pty pty,
            std::unique_ptr<bushd::sim::VcdWriter> trace);
  void add_mcus(const Options& options);
  void start(bushd::sim::TimeNs start_ns);
  bushd::Result<void> plug_in();
  void unplug();
  bushd::Result<void> take_signals();
  bushd::Result<void> take_keys();
  void press(char key);
  void overload(bool on);
  void reset(bushd_reset_cause cause);
  void show();
  void drive_inputs();
  bushd::sim::TimeNs wall_time_ns() const;
  bushd::Result<void> take_bytes(bushd::sim::TimeNs now_ns);
  bushd::Result<void> hand_out_replies(bushd::sim::TimeNs now_ns);
  bool line_takes_more(bushd::sim::TimeNs now_ns) const;
  bushd::sim::TimeNs sleep_ns(bushd::sim::TimeNs now_ns) const;
  void report_collision(bushd::sim::TimeNs time_ns, std::uint8_t first, std::uint8_t second);
  void slip();
  bushd::Result<void> loop();

  Waiter waiter_;
  Setup setup_;
  std::vector<std::string> links_;
  std::size_t links_used_ = 1;
  std::optional<Pty> pty_;  // none: unplugged
  std::unique_ptr<bushd::sim::VcdWriter> trace_;
  bushd::sim::Bus bus_;
  std::vector<bool> is_virtual_;  // by MCU
  bool has_images_;
  std::int64_t start_ns_ = 0;  // CLOCK_MONOTONIC at simulated time 0
  Adapter adapter_;
  bool has_bit_errors_;
  std::uint64_t dropped_bytes_ = 0;
  bool ended_ = false;      // by a signal
  bool triggered_ = false;  // the trigger inputs are active
  std::optional<TypedKeys> typed_;
  std::optional<std::size_t> console_;  // at which MCU
  std::uint8_t buttons_ = 0;            // that are held there: BUSHD_INPUT_*
  bool overloaded_ = false;             // its supply
  std::vector<std::uint8_t> closed_;    // by MCU: contacts as told last, BUSHD_INPUT_*
};

}  // namespace bushsim
