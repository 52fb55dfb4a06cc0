// The motors behind a BUSHD-2. A program becomes the table of its motor's group if the MCUs of the
// group rest, and the motor is moved by it as by any table. Where they move other motors, it is
// moved by the program at once, along a line of its own (lines.h). The module is told as much of it
// as MCUs report.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/precedence.h"
#include "daemon/services/camac_asker.h"
#include "daemon/services/camac_program.h"
#include "daemon/services/lines.h"
#include "daemon/services/tables_in_service.h"
#include "heritage/camac/bushd2.h"

namespace bushd::daemon {

// The table of a program: as many of its codes, from the first one on, as never rise.
Result<tables::TablePtr> table_of_program(const camac::Program& program, int f_start_hz,
                                          const std::string& module);

// What the limit switches of a motor say: right is in positive direction.
camac::MotorStatus limits_of(const Installation& installation, MotorId motor);

class CamacMotors final : public camac::Motors {
 public:
  // `name` is that of the module: "camac-1-5".
  CamacMotors(std::string name, const config::CamacModule& module, Installation& installation,
              const Interlocks& interlocks, const Precedence& precedence, const CamacTurn& turn,
              TablesInService& tables, Lines& lines, const Programs& programs, Outputs& outputs,
              AskCore ask)
      : name_(std::move(name)),
        config_(module),
        installation_(installation),
        interlocks_(interlocks),
        precedence_(precedence),
        turn_(turn),
        tables_(tables),
        lines_(lines),
        outputs_(outputs),
        ask_(std::move(ask)),
        session_(std::make_shared<CamacSession>(name_)),
        program_(name_, programs, session_, ask_) {}

  camac::MotorStatus status(int motor) override;
  bool move(const camac::Program& program) override;
  void stop(int motor) override;

  // A motion that has been begun before a stop of its motor, and is not yet asked of it, does not
  // begin.
  void end_overtaken();

  // What people are told of the motion that was permitted last; empty: nothing.
  std::string take_note() { return std::exchange(note_, {}); }

  // Does what is due, and tells the module what has become of its motion.
  void step(std::int64_t now_us, camac::Bushd2& module);

  // A motion that goes on without the daemon, once its MCU has it; and one that a daemon before has
  // left so.
  std::optional<KeptMotion> to_keep(const camac::Bushd2& module) const;
  void find(const KeptMotion& kept, camac::Bushd2& module);

 private:
  struct Motion {
    enum class Stage { kBegins, kGetsTable, kMoves };
    MotorId motor;
    camac::Program program;
    tables::TablePtr table;  // of its group; null: it goes by a program of the MCU
    bool alone = false;      // by that
    Stage stage = Stage::kBegins;
    std::int64_t from_steps = 0;
    std::uint32_t told = 0;  // of its steps
    bool to_stop = false;
    bool stopping = false;          // it was asked to
    std::uint64_t after_stops = 0;  // as Asker::after_stops
  };

  // Precondition: there is a motion.
  api::Asker asker() {
    return {.session = session_,
            .number = session_->next_number(),
            .after_stops = motion_->after_stops};
  }
  void begin(std::int64_t now_us, camac::Bushd2& module);
  bool streams() const;
  void follow_table(std::int64_t now_us, camac::Bushd2& module);
  void move(std::int64_t now_us, camac::Bushd2& module, const tables::TablePtr& by);
  void follow_move(std::int64_t now_us, camac::Bushd2& module);
  std::int64_t moved(const Motion& motion) const;
  void tell_steps(camac::Bushd2& module);
  void end(camac::Bushd2& module, const api::Reply& reply);
  void warn(MotorId motor, const std::string& why);
  void note(std::int64_t of_fastest_ns);
  std::int64_t fastest_ns(const camac::Program& program) const;

  const std::string name_;
  const config::CamacModule& config_;
  Installation& installation_;
  const Interlocks& interlocks_;
  const Precedence& precedence_;
  const CamacTurn& turn_;
  TablesInService& tables_;
  Lines& lines_;
  Outputs& outputs_;
  AskCore ask_;
  std::shared_ptr<CamacSession> session_;
  CamacProgram program_;
  std::string note_;
  std::shared_ptr<CamacSession> stops_ = std::make_shared<CamacSession>(name_);
  std::optional<Motion> motion_;
};

}  // namespace bushd::daemon
