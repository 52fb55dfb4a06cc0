// What a stop ends of what has not begun: all that arrived before it, from whomever and wherever it
// waits. Stops are counted as they arrive (api::Motion), and every request knows after how
// many of them it arrived (api::Asker::after_stops). So one comparison tells, for each motor,
// whether a stop of this motor has come since.
//
// Whoever lets requests wait asks this class about them when a stop has come
// (Service::end_overtaken), and ends those that it names by OpenMoves::not_begun.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/session.h"
#include "base/by_id.h"
#include "daemon/model/installation.h"
#include "daemon/model/stop_count.h"

namespace bushd::daemon {

// Who asked, in a sentence: "command 7 of bushctl-1".
std::string text_of(const api::Asker& asker);

class Precedence {
 public:
  explicit Precedence(const Installation& installation);

  StopCount& counted() { return counted_; }
  std::uint64_t stops() const { return counted_.stops(); }

  // This request, counted as Asker::after_stops, ends what arrived before it. Names that it does
  // not know are none.
  void note(const api::Asker& asker, const api::Request& request);
  // All motors are stopped, by the daemon itself.
  void note_all(const std::string& by);

  // Which motor of these was stopped since, and by whom.
  struct Overtaken {
    MotorId motor;
    std::string by;
    std::vector<MotorId> of{};
  };
  // What has overtaken a request that moves motors, or lets them move, for those that it names.
  // Only who has the parts of a path or a trajectory can tell it of these.
  std::optional<Overtaken> overtaken(const api::Asker& asker, const api::Request& request) const;
  std::optional<Overtaken> overtaken(std::uint64_t after_stops,
                                     const std::vector<MotorId>& motors) const;

 private:
  struct Stop {
    std::uint64_t number = 0;
    std::shared_ptr<const std::string> by{};
  };
  using Stops = ById<MotorId, Stop>;

  std::optional<Overtaken> find(const Stops& stops, std::uint64_t after_stops,
                                const std::vector<MotorId>& motors) const;

  const Installation& installation_;
  StopCount counted_;
  Stops newest_;           // of whatever kind
  Stops holds_;            // which a release ends
  Stops emergency_stops_;  // which clearing of faults lifts
};

}  // namespace bushd::daemon
