// The program of one MCU (engine/program.h): what is known of it, and the requests about it.
//
// An upload is sent in parts when nothing else is asked of the MCU, then committed. Orders (run,
// stop, pause, resume, erase) go in their order, each acknowledged before the next; one that is to
// take motion away discards those that would begin it. After each, while a program is under way,
// and until one that is to outlive power cuts would, the MCU is asked how it does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "bus/rs485/offers.h"
#include "bus/rs485/request.h"
#include "engine/message.h"

namespace bushd::link {

class ProgramLink {
 public:
  const ProgramView& view() const { return view_; }
  // The view tells what is so now: nothing has been asked since that could have changed it.
  bool settled() const { return view_.known && !wanted_ && orders_.empty(); }
  // The MCU has refused to tell: it knows no programs, whatever its identity says.
  bool denied() const { return denied_; }

  // Nothing is known of it, and nothing asked.
  void clear() { *this = {}; }
  // It is to be asked how its program does.
  void want_state() { wanted_ = true; }
  bool wants_state() const { return wanted_ && !denied_; }

  void put(std::vector<std::uint8_t> bytes);
  void erase();
  void run(std::uint8_t number, Tick start);
  void stop(bushd_stop_mode mode);
  void pause();
  void resume();
  // An emergency stop: what would begin motion, and was asked before, is discarded.
  void discard_motion();
  // A run that the MCU has not taken by tick `now` + `margin` is ended, whether it comes or not.
  // Returns true if there was one.
  bool end_late_run(Tick now, Tick margin);

  bool has_orders() const { return !orders_.empty(); }
  // An order that takes motion away is the next one, and has not been sent lately.
  bool is_urgent(std::int64_t now_us) const {
    return takes_motion_away() && now_us >= urgent_from_us_;
  }
  std::int64_t urgent_due_us() const { return takes_motion_away() ? urgent_from_us_ : INT64_MAX; }
  // An order, or the question that is due. Precondition of ask_...: they are sent now.
  bool has_request(std::int64_t now_us) const { return has_orders() || now_us >= due_us(); }
  const Request& ask(std::int64_t now_us);
  bool has_part() const { return !upload_.empty(); }
  const Request& ask_part();
  // When the MCU is to be asked how its program does; INT64_MAX: not at all.
  std::int64_t due_us() const;

  enum class Answer { kNone, kTaken, kRefused, kOfUpload };
  // To a request of this type, in its turn. What answers one that was discarded meanwhile is none.
  Answer acknowledged(std::uint8_t type, std::uint8_t status);
  void told(std::int64_t now_us, const bushd_program_state& state);

  static bool is_about_programs(std::uint8_t type) {
    return type == BUSHD_MSG_PROGRAM_PUT || type == BUSHD_MSG_PROGRAM ||
           type == BUSHD_MSG_PROGRAM_STATE;
  }

 private:
  struct Order {
    bushd_program_action action;
    Tick start;  // of RUN
    std::uint32_t serial;
    Request request;
  };
  void order(bushd_program_action action, std::uint8_t number, std::uint32_t value, Tick start = 0);
  void discard(std::uint32_t actions);
  bool takes_motion_away() const;
  void end_upload(std::uint8_t status);

  ProgramView view_;
  std::deque<Order> orders_;
  std::deque<Request> upload_;  // parts, then the commit
  std::uint32_t serial_ = 0;    // of the last order or upload; none is 0
  std::uint32_t asked_ = 0;     // the one of which a request has been sent, and not answered yet
  std::uint32_t upload_serial_ = 0;
  bool wanted_ = false;
  bool denied_ = false;
  bool storing_ = false;  // what it has now may not outlive a reset yet
  std::int64_t urgent_from_us_ = 0;
  Request question_{.type = BUSHD_MSG_PROGRAM_STATE, .payload = {}};
};

}  // namespace bushd::link
