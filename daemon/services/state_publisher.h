// Tells clients what motors and MCUs do: 20 times a second, and at once on change; of an MCU that
// rests and tells nothing new, less often. And what rarely changes, every few seconds and on
// change.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/installation.h"
#include "daemon/model/outputs.h"
#include "daemon/services/open_moves.h"
#include "daemon/services/pseudo_axes.h"

namespace bushd::daemon {

class StatePublisher {
 public:
  static constexpr std::int64_t kPeriodUs = 50'000;
  // Where more MCUs move, so many are told of each time, in turns, unless more than positions has
  // changed: 2560 messages, 6 MB a second, are as much as clients in Python take.
  static constexpr std::size_t kMostInMotion = 128;
  // Clients are told half a second after the state before at the latest: that must be there by
  // then.
  static constexpr std::int64_t kRestingPeriodUs = 200'000;
  // What has come is told this much later at most: reports come as often, and with them the time to
  // tell of them, so nothing is woken for that alone.
  static constexpr std::int64_t kSlackUs = 5'000;
  // Reports come exactly as often, give or take this: it is time to tell of one when it is there.
  static constexpr std::int64_t kReportJitterUs = 2'000;
  // "At once on change", but not more often than this: a client that sends many requests must not
  // make the daemon flood the network.
  static constexpr std::int64_t kMinPeriodUs = 5'000;
  // Passed on to clients every few seconds only (Publishing).
  static constexpr std::int64_t kDescriptionPeriodUs = 1'000'000;

  // What an MCU has under way, and where, in words; "": nothing.
  using ProgramOf = std::function<std::string(McuId)>;

  StatePublisher(Installation& installation, const PseudoAxes& pseudo_axes,
                 const OpenMoves& open_moves, ProgramOf program_of, Outputs& outputs,
                 std::size_t most_in_motion = kMostInMotion);

  void step(std::int64_t now_us);
  // Something other than reports may have changed what clients see: nothing is taken to be as it
  // was when it is published next.
  void look_anew() { anew_ = true; }
  // As it is now, whether due or not.
  void publish_all(std::int64_t now_us);
  std::int64_t next_wake_us() const;

 private:
  // What the last snapshot of an MCU was made of.
  struct Told {
    std::int64_t due_us = 0;  // whatever it tells
    bushd_report report{};
    std::string note;
  };
  void publish_due(std::int64_t now_us);
  void publish(std::int64_t now_us, McuId id);
  void publish_moving(std::int64_t now_us);
  void publish_axes(std::int64_t now_us);
  bool is_as_told(std::int64_t now_us, const Mcu& mcu) const;
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
  const std::size_t most_in_motion_;
  ById<McuId, Described> described_;  // then computed axes
  ById<McuId, Told> told_;
  bool anew_ = true;
  std::vector<McuId> moving_;
  McuId first_moving_{0};  // or the next one that moves
  std::int64_t due_us_ = 0;
  std::int64_t sent_us_ = INT64_MIN / 2;
};

}  // namespace bushd::daemon
