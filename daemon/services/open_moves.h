// Which requests have motors under way (moves, homing, armed moves), and the one answer that each
// gets when the last of its motors has ended.
#pragma once

#include <cstdint>
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

  // Precondition: none of the motors is under way.
  void open(api::Asker asker, const std::vector<MotorId>& motors);
  // This motor's part has ended. One that is in no open move is ignored.
  void end(MotorId motor, api::Outcome outcome, const std::string& reason);

  bool empty() const { return book_.empty(); }
  bool together(MotorId a, MotorId b) const { return book_.move_of(a) == book_.move_of(b); }
  // Whose request it is; null if none.
  const api::Asker* asker_of(MotorId motor) const;

 private:
  struct Open {
    api::Asker asker;
    std::vector<api::TableRef> tables;  // by which its motors move, in the request's order
  };

  Installation& installation_;
  motion::MoveBook book_;
  std::unordered_map<std::uint64_t, Open> open_;  // by number in book_
};

}  // namespace bushd::daemon
