// Axes that are computed from motors ([[pseudo]]). What is asked of them is asked of their motors:
// a move becomes a line, so that the axis goes straight, and no other part of the core knows of
// them. They are shown as motors of a part of their own, whose steps are counts of the last decimal
// that people see.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "api/request.h"
#include "api/session.h"
#include "api/snapshot.h"
#include "daemon/model/installation.h"

namespace bushd::daemon {

class PseudoAxes {
 public:
  explicit PseudoAxes(const Installation& installation) : installation_(installation) {}

  std::size_t size() const { return installation_.config().pseudos.size(); }

  // The same, asked of motors; nothing if the request names no computed axis. Moves are to where
  // the motors stand when they have made what they were told before. Errors: axes of two sections,
  // or axes and motors, in one move; a target beyond a limit of the axis or its calibration; what
  // cannot be asked of a computed axis.
  Result<std::optional<api::Request>> of_motors(const api::Request& request) const;

  // From which the axes are computed that it names.
  std::vector<MotorId> motors_of(const api::Move& move) const;

  // Wraps the asker: the result that it gets has one for each computed axis of the move, in the
  // order in which they were asked, before those of the motors. Not for a move that names none.
  api::Asker told_of_axes(const api::Asker& asker, const api::Move& move) const;

  // As parts 0 .. size()-1. `motor`: what is published of each motor.
  using StateOf = std::function<api::MotorState(MotorId)>;
  api::StateSnapshot state(std::size_t index, const StateOf& motor) const;
  api::Description description(std::size_t index) const;

 private:
  struct Place {
    std::size_t pseudo;
    std::size_t axis;
  };
  class Told;

  std::optional<Place> find(const std::string& name) const;
  api::MotorResult result_of(const Place& place, const api::Completed& of_motors) const;
  std::string motors_text(const config::Pseudo& pseudo) const;
  Result<api::Request> of_motors(const api::Move& move) const;
  Result<std::vector<double>> positions_asked(const api::Move& move, const config::Pseudo& pseudo,
                                              const std::vector<double>& motors) const;

  const Installation& installation_;
};

}  // namespace bushd::daemon
