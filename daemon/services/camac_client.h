// What the motors behind a BUSHD-2 and the motor behind a BUSHD-1 have of the daemon: they ask as
// any client does, put a table in service, stop, and tell people what could not be done.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/model/interlocks.h"
#include "daemon/model/outputs.h"
#include "daemon/model/precedence.h"
#include "daemon/services/camac_asker.h"
#include "daemon/services/camac_program.h"
#include "daemon/services/tables_in_service.h"

namespace bushd::daemon {

struct CamacParts {
  Installation& installation;
  const Interlocks& interlocks;
  const Precedence& precedence;
  const CamacTurn& turn;
  TablesInService& tables;
  const Programs& programs;
  Outputs& outputs;
  AskCore ask;
};

class CamacClient {
 public:
  // What people are told of the motion that was permitted last; empty: nothing.
  std::string take_note() { return std::exchange(note_, {}); }

 protected:
  // `name` is that of the module: "camac-1-5".
  CamacClient(std::string name, const CamacParts& parts)
      : name_(std::move(name)),
        installation_(parts.installation),
        interlocks_(parts.interlocks),
        precedence_(parts.precedence),
        turn_(parts.turn),
        tables_(parts.tables),
        outputs_(parts.outputs),
        ask_(parts.ask),
        session_(std::make_shared<CamacSession>(name_)),
        program_(name_, parts.programs, session_, ask_),
        stops_(std::make_shared<CamacSession>(name_)) {}
  ~CamacClient() = default;

  void warn(MotorId motor, const std::string& why) {
    outputs_.log(LogLevel::kWarning, motor, name_ + ": " + why);
  }
  // How the motor stops in codes as they are written.
  void note(MotorId motor, std::int64_t fastest_ns) {
    note_ = as_written_note(installation_, motor, fastest_ns);
    warn(motor, note_);
  }
  // For the next request, as Asker::after_stops.
  api::Asker asker(std::uint64_t after_stops) {
    return {.session = session_, .number = session_->next_number(), .after_stops = after_stops};
  }
  // Asks for the table of the motor's group to be this one; done at once if it is.
  void use_table(std::int64_t now_us, MotorId motor, const tables::TablePtr& table,
                 std::uint64_t after_stops) {
    const GroupId group = installation_.config()[motor].group;
    const api::Asker by = asker(after_stops);
    if (installation_.tables()[group]->content_hash() == table->content_hash()) {
      return by.answer(api::done(""));
    }
    tables_.use(now_us, by, group, table);
  }
  void ask_to_stop(std::int64_t now_us, MotorId motor) {
    ask_(now_us, {.session = stops_, .number = stops_->next_number()},
         api::Stop{{installation_[motor].name()}});
  }

  const std::string name_;
  Installation& installation_;
  const Interlocks& interlocks_;
  const Precedence& precedence_;
  const CamacTurn& turn_;
  TablesInService& tables_;
  Outputs& outputs_;
  AskCore ask_;
  std::shared_ptr<CamacSession> session_;
  CamacProgram program_;

 private:
  std::shared_ptr<CamacSession> stops_;
  std::string note_;
};

}  // namespace bushd::daemon
