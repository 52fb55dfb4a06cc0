// Motors that move on for as long as somebody keeps a key pressed: at a speed, up to the soft
// limit. A jog is a motion like any other to that limit, which is given another target with each
// change of speed and direction; what is here is whose it is, and what ends it.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/service.h"
#include "daemon/services/moves.h"
#include "daemon/services/open_moves.h"

namespace bushd::daemon {

class Jogs final : public Service {
 public:
  Jogs(Installation& installation, const Interlocks& interlocks, Moves& moves,
       OpenMoves& open_moves)
      : installation_(installation), interlocks_(interlocks), moves_(moves), open_(open_moves) {}

  void request(std::int64_t now_us, const api::Asker& asker, const api::Jog& request);
  // As things stand, whoever asks.
  bool would_take(const api::Jog& request) const;

  void step(std::int64_t now_us) override;
  std::int64_t next_wake_us() const;

 private:
  struct Course {
    int direction;
    std::int64_t target;
    bushd_delay shortest_delay;
  };
  struct Jog {
    api::Asker opened_by;  // whose result it is
    api::Asker renewed_by;
    std::int64_t keepalive_us;
    std::int64_t until_us;  // unless it is renewed
    Course course;
    bool ends = false;    // by a client, or for want of its own
    bool let_go = false;  // its own has ended it
    struct After {
      std::int64_t steps;
      std::int64_t from;  // where the motor was when that was asked
    };
    std::optional<After> after{};
    std::vector<api::Asker> waiting{};  // for its end
  };
  // A client whose jog was ended by others does not begin another one before it has let go.
  struct Barred {
    MotorId motor;
    api::Asker client;
    std::int64_t keepalive_us;
    std::int64_t until_us;
  };

  Result<Course> course_of(MotorId motor, const api::Jog& request) const;
  Result<void> may_jog(std::int64_t now_us, MotorId motor, const api::Asker& asker);
  void run(std::int64_t now_us, const api::Asker& asker, MotorId motor, const api::Jog& request);
  void say_limit(MotorId motor);
  void change(std::int64_t now_us, const api::Asker& asker, MotorId motor, const Course& course);
  void renew(std::int64_t now_us, const api::Asker& asker, MotorId motor);
  void end(std::int64_t now_us, const api::Asker& asker, MotorId motor, const api::Jog& request);
  // `ended`: with which outcome, and by whom.
  void end_after(std::int64_t now_us, MotorId motor, std::int64_t steps,
                 const OpenMoves::Saying& ended);
  void ramp_down(std::int64_t now_us, MotorId motor, OpenMoves::Saying saying);
  // Whoever has opened it still has the motor.
  bool is_open(MotorId motor, const Jog& jog) const;
  bool is_stopped_by_others(MotorId motor, const Jog& jog) const;
  void follow(std::int64_t now_us, MotorId motor, Jog& jog);
  void has_ended(std::int64_t now_us, MotorId motor, const Jog& jog);

  Installation& installation_;
  const Interlocks& interlocks_;
  Moves& moves_;
  OpenMoves& open_;
  std::map<MotorId, Jog> jogs_;
  std::list<Barred> barred_;
};

}  // namespace bushd::daemon
