// Tells clients what motors and MCUs do: 20 times a second, and at once on change; and what rarely
// changes, every few seconds and on change.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "daemon/model/installation.h"
#include "daemon/model/outputs.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/pseudo_axes.h"

namespace bushd::daemon {

class StatePublisher {
 public:
  static constexpr std::int64_t kPeriodUs = 50'000;
  // "At once on change", but not more often than this: a client that sends many requests must not
  // make the daemon flood the network.
  static constexpr std::int64_t kMinPeriodUs = 5'000;
  // Passed on to clients every few seconds only (Publishing).
  static constexpr std::int64_t kDescriptionPeriodUs = 500'000;

  // What an MCU has under way, and where, in words; "": nothing.
  using ProgramOf = std::function<std::string(McuId)>;

  StatePublisher(Installation& installation, const PseudoAxes& pseudo_axes,
                 const OpenMoves& open_moves, ProgramOf program_of, Outputs& outputs);

  void step(std::int64_t now_us);
  // As it is now, whether due or not.
  void publish_all(std::int64_t now_us);
  std::int64_t next_wake_us() const;

 private:
  api::StateSnapshot state_of(const Mcu& mcu) const;
  api::MotorState state_of(const Mcu& mcu, const motion::Motor& motor) const;
  api::Description description_of(const Mcu& mcu) const;
  bool describes(std::int64_t now_us, McuId part) const;
  void publish(std::int64_t now_us, McuId part, api::Description description);

  struct Described {
    std::optional<api::Description> last;
    std::int64_t due_us = 0;
  };
  Installation& installation_;
  const PseudoAxes& pseudo_axes_;
  const OpenMoves& open_moves_;
  ProgramOf program_of_;
  Outputs& outputs_;
  ById<McuId, Described> described_;  // then computed axes
  std::int64_t due_us_ = 0;
  std::int64_t sent_us_ = INT64_MIN / 2;
};

}  // namespace bushd::daemon
