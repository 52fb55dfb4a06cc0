// A commutator board behind a pty, paced to the clock on the wall.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "descriptor.h"
#include "pty.h"
#include "setup.h"
#include "sim/board_line.h"
#include "sim/vcd.h"
#include "waiter.h"

namespace bushsim {

// How the converter of a board differs from what the configuration says of it.
struct ConverterErrors {
  double gain = 1;          // times that of the configuration
  double offset_codes = 0;  // sim::FrequencyConverter::Character, as the next one
  double drift_per_s = 0;
};

class BoardSimulator {
 public:
  struct Options {
    Setup setup;                     // of a board
    std::vector<SwitchAt> switches;  // of its motors' numbers
    std::vector<std::string> links;  // as of Simulator
    std::string trace;
    std::string image = {};  // that it runs in simavr; "": it is a model of one
    ConverterErrors converter = {};
  };
  // Makes all that can fail, and takes the signals of Waiter.
  static bushd::Result<std::unique_ptr<BoardSimulator>> create(const Options& options);

  // Until a signal ends it. SIGUSR1 takes the serial adapter away, SIGUSR2 plugs it in again.
  bushd::Result<void> run();
  // What was done, for people.
  std::string summary() const;

 private:
  BoardSimulator(const Options& options, Waiter waiter, Pty pty,
                 std::unique_ptr<bushd::sim::VcdWriter> trace);
  static std::unique_ptr<bushd::sim::BoardEnd> make_board(const Options& options,
                                                          bushd::sim::EdgeSink* trace);
  bushd::sim::TimeNs now_ns() const;
  bushd::Result<void> wait() const;
  bushd::Result<void> take_signals();
  bushd::Result<void> take_bytes();
  bushd::Result<void> hand_out_answers();

  Waiter waiter_;
  const std::vector<std::string> links_;
  std::size_t links_used_ = 1;
  std::optional<Pty> pty_;  // none: unplugged
  std::unique_ptr<bushd::sim::VcdWriter> trace_;
  const std::unique_ptr<bushd::sim::BoardEnd> board_;
  const std::int64_t start_ns_;  // CLOCK_MONOTONIC at simulated time 0
  bool ended_ = false;
};

}  // namespace bushsim
