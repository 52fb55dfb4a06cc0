// Which requests have motors under way (moves, homing, armed moves), and the one answer that each
// gets when the last of its motors has ended.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "api/session.h"
#include "daemon/installation.h"
#include "motion/move_book.h"

namespace bushd::daemon {

// Who asked, in a sentence: "command 7 of bushctl-1".
std::string text_of(const api::Asker& asker);

class OpenMoves {
 public:
  explicit OpenMoves(Installation& installation) : installation_(installation) {}

  // A motor's part that has ended.
  struct Ended {
    MotorId motor;
    const std::string& what;
    const api::Asker& asker;
    std::int64_t from_steps;
    api::Outcome outcome;
    const std::string& reason;
  };
  using Listener = std::function<void(const Ended&)>;
  void set_listener(Listener listener) { listener_ = std::move(listener); }

  // Precondition: none of the motors is under way. `what`: move, home, arm.
  void open(api::Asker asker, const std::vector<MotorId>& motors, std::string what = "move");
  // This motor's part has ended. One that is in no open move is ignored.
  void end(MotorId motor, api::Outcome outcome, const std::string& reason);

  // Somebody has asked this motor to stop: if its part ends with that, the reason says who. One
  // that is in no open move is ignored.
  void stopped_by(MotorId motor, const std::string& who);
  // It moves on, for somebody else.
  void not_stopped(MotorId motor) { stopped_by_.erase(motor); }

  bool empty() const { return book_.empty(); }
  bool together(MotorId a, MotorId b) const { return book_.move_of(a) == book_.move_of(b); }
  // Whose request it is; null if none.
  const api::Asker* asker_of(MotorId motor) const;

 private:
  struct Open {
    api::Asker asker;
    std::string what;
    std::unordered_map<MotorId, std::int64_t> from_steps{};
    std::vector<api::TableRef> tables;  // by which its motors move, in the request's order
  };

  void tell(MotorId motor, api::Outcome outcome, const std::string& reason) const;

  Installation& installation_;
  Listener listener_;
  motion::MoveBook book_;
  std::unordered_map<std::uint64_t, Open> open_;  // by number in book_
  std::unordered_map<MotorId, std::string> stopped_by_;
};

}  // namespace bushd::daemon
