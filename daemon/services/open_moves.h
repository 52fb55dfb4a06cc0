// Which requests have motors under way (moves, homing, armed moves, travel), and the one answer
// that each gets when the last of its motors has ended.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "api/session.h"
#include "daemon/model/installation.h"
#include "daemon/model/precedence.h"
#include "motion/move_book.h"

namespace bushd::daemon {

class OpenMoves {
 public:
  explicit OpenMoves(Installation& installation)
      : installation_(installation), precedence_(installation) {}

  enum class Purpose { kMove, kHome, kArm, kJog, kLine, kTravel, kFollow, kProgram };

  // A motor's part that has ended.
  struct Ended {
    MotorId motor;
    Purpose purpose;
    const api::Asker& asker;
    std::int64_t from_steps;
    api::Outcome outcome;
    const std::string& reason;
  };
  using Listener = std::function<void(const Ended&)>;
  void set_listener(Listener listener) { listener_ = std::move(listener); }

  // Precondition: none of the motors is under way. `by`: the table of all of them, if it is not
  // their own.
  void open(api::Asker asker, const std::vector<MotorId>& motors, Purpose purpose,
            const tables::TablePtr& by = {});
  // How a motor's part is made: its legs, and the speed that none of them exceeds.
  void planned(MotorId motor, int legs, double most_steps_per_s);
  // What is said of this motor's part, which is open, if its plan ends with `outcome`; not if
  // something else ends it.
  struct Saying {
    api::Outcome outcome;
    std::string reason;
  };
  void say(MotorId motor, api::Outcome outcome, Saying saying);
  void unsay(MotorId motor, api::Outcome outcome);
  // What is added to the reason of the result of this motor's move, asked for when all has ended.
  void conclude(MotorId motor, std::function<std::string()> conclusion);
  // This motor's part has ended; `by_plan`: as its plan does. One that is in no open move is
  // ignored.
  void end(MotorId motor, api::Outcome outcome, const std::string& reason, bool by_plan = false);

  // Somebody has asked these motors to stop: if a part ends with that, the reason says who. Those
  // that are in no open move are ignored.
  void stopped_by(const std::vector<MotorId>& motors, const std::string& who);
  // This motor moves on, for somebody else.
  void not_stopped(MotorId motor) { stopped_by_.erase(motor); }

  // Which requests have been ended before they had a motor under way.
  Precedence& precedence() { return precedence_; }
  const Precedence& precedence() const { return precedence_; }
  // Answers a request that a stop has ended before it was carried out; it may have been accepted.
  // Its motors may be under way for others.
  void not_begun(const api::Asker& asker, const Precedence::Overtaken& overtaken) const;

  bool empty() const { return book_.empty(); }
  bool together(MotorId a, MotorId b) const { return book_.move_of(a) == book_.move_of(b); }
  // Whose request it is; null if none.
  const api::Asker* asker_of(MotorId motor) const;
  // For reasons: ", asked for by command 7 of panel"; "" if it is nobody's.
  std::string asked_for_by(MotorId motor) const;

 private:
  struct Open {
    api::Asker asker;
    Purpose purpose;
    std::unordered_map<MotorId, std::int64_t> from_steps{};
    std::vector<api::TableRef> tables;  // by which its motors move, in the request's order
    std::map<std::pair<MotorId, api::Outcome>, Saying> sayings{};
    std::function<std::string()> conclusion{};
    struct Plan {
      int legs = 1;
      double most_steps_per_s = 0;
    };
    std::map<MotorId, Plan> plans{};
  };

  void tell(MotorId motor, api::Outcome outcome, const std::string& reason) const;
  api::MotorResult result_of(MotorId motor, api::Outcome outcome, std::int64_t position_steps,
                             const api::Asker& asker) const;

  Installation& installation_;
  Precedence precedence_;
  Listener listener_;
  motion::MoveBook book_;
  std::unordered_map<std::uint64_t, Open> open_;  // by number in book_
  std::unordered_map<MotorId, std::string> stopped_by_;
};

// As the history of a motor has it.
std::string_view word(OpenMoves::Purpose purpose);

}  // namespace bushd::daemon
