// An MCU that is found while its program has motors: it is not configured anew, which it would
// refuse, and which would end what it was left alone with.
//
// What it takes all the same it takes only if it is as it has it: CONFIGURE, EMISSION and OUTPUTS
// are told, its tables are asked for, and any difference shows. Then the motors that rest are told
// of, and it goes online with its program; INPUTS, which it would refuse whatever they are, and
// what else is left follow when the program has ended. With a difference it is left alone.
#include <string>

#include "bus/rs485/connector.h"
#include "engine/program.h"

namespace bushd::link {
namespace {

const char* const kOther =
    "runs a program of another configuration, and is left alone: wait until that has ended, or "
    "stop it";
const char* const kEnds = "its program is being ended";
const char* const kOthersMove =
    "runs a program, and an earlier master has begun other motions: wait until those have ended, "
    "or stop it";
const char* const kOutOfStep =
    "runs a program, and its clock is not that of the bus until the motors rest: wait for that, or "
    "stop it";

bool has_program(const McuView& view) {
  return (view.identity.capabilities & BUSHD_CAN_PROGRAM) != 0;
}

}  // namespace

// Asked before anything else: what comes after depends on it.
void Connector::ask_for_program(McuIndex mcu) {
  links_[mcu].program.clear();
  if (has_program(mcus_[mcu].view)) links_[mcu].program.want_state();
}

bool Connector::knows_program(McuIndex mcu) const {
  const ProgramLink& program = links_[mcu].program;
  return !has_program(mcus_[mcu].view) || program.settled() || program.denied();
}

bool Connector::runs_program(McuIndex mcu) const {
  const ProgramView& program = links_[mcu].program.view();
  return program.known && program.under_way();
}

bool Connector::may_have_own_time(McuIndex mcu) const {
  return mcus_[mcu].view.phase == McuPhase::kConnecting &&
         (!knows_program(mcu) || runs_program(mcu));
}

bool Connector::runs_with_host() const {
  for (const McuIndex i : mcus_.indices()) {
    const std::uint8_t flags = links_[i].program.view().state.flags;
    if (runs_program(i) && (flags & BUSHD_PROGRAM_WITHOUT_HOST) == 0) return true;
  }
  return false;
}

void Connector::write_adoption(McuIndex mcu) {
  links_[mcu].adopts = true;
  write_configuration(mcu);
  links_[mcu].queue.ask_for_tables();
  links_[mcu].setup_written = true;
}

void Connector::leave_alone(McuIndex mcu) {
  links_[mcu].left_alone = true;
  links_[mcu].queue.discard_setup();
  mcus_[mcu].view.detail = kOther;
}

// Those of its motors that rest; the others have theirs, or RUN would have been refused.
void Connector::adopt_tables(McuIndex mcu, const bushd_tables& held, bool may_clear) {
  if (!holds_its_tables(mcu, held)) return leave_alone(mcu);
  const std::uint16_t motors = links_[mcu].program.view().state.motors;
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const auto bank = mcus_[mcu].setup.table_of_motor[m];
    if (bank && (motors >> m & 1) == 0) links_[mcu].queue.ask(bushd_assign{m, *bank});
  }
  tell_local(mcu);
  const unsigned clear = first_actions(mcu, may_clear) & unsigned{BUSHD_CONTROL_CLEAR_FAULTS};
  const bool any = mcus_[mcu].view.report.faults != 0;
  if (any && clear != 0) add_control(mcu, static_cast<std::uint8_t>(clear));
}

bool Connector::goes_on_with_program(McuIndex mcu) {
  Link& link = links_[mcu];
  McuView& view = mcus_[mcu].view;
  if (!runs_program(mcu)) {
    // What was told for the sake of the program is not enough any more.
    if (link.adopts || link.left_alone) {
      link.adopts = link.left_alone = link.setup_written = false;
      link.queue.discard_setup();
      view.detail = "being configured";
    }
    return false;
  }
  if (link.left_alone || link.setup_written) return true;
  const bushd_program_state& state = link.program.view().state;
  if (state.stage == BUSHD_PROGRAM_ENDS) {
    view.detail = kEnds;
  } else if ((view.report.moving & ~state.motors) != 0) {
    view.detail = kOthersMove;
  } else {
    view.detail = "being configured";
    write_adoption(mcu);
  }
  return true;
}

void Connector::follow_program(McuIndex mcu, bool in_step) {
  const Link& link = links_[mcu];
  if (link.left_alone || !link.setup_written || !link.queue.empty()) return;
  if (!in_step) {
    mcus_[mcu].view.detail = kOutOfStep;
  } else if (mcus_[mcu].view.report.state != BUSHD_STATE_BUSY) {
    go_online(mcu);
  }
}

bool Connector::has_more_to_tell(McuIndex mcu) const {
  const Link& link = links_[mcu];
  const bushd_report& report = mcus_[mcu].view.report;
  const bool rests = (report.moving | report.armed) == 0;
  return link.adopts && rests && link.program.settled() && !runs_program(mcu) &&
         link.queue.empty() && !mcus_[mcu].answered;
}

void Connector::end_late_runs(Tick now, Tick margin) {
  for (const McuIndex i : mcus_.indices()) {
    if (!links_[i].program.end_late_run(now, margin)) continue;
    listener_.refused(i, BUSHD_MSG_PROGRAM, BUSHD_E_LATE);
  }
}

void Connector::program_told(std::int64_t now_us, McuIndex mcu, const bushd_program_state& state) {
  links_[mcu].program.told(now_us, state);
  if (mcus_[mcu].view.phase == McuPhase::kConnecting) want_report(mcu, true);
  listener_.program_reported(mcu);
}

void Connector::program_acknowledged(McuIndex mcu, std::uint8_t type, std::uint8_t status) {
  const auto answer = links_[mcu].program.acknowledged(type, status);
  if (answer == ProgramLink::Answer::kOfUpload) return listener_.program_reported(mcu);
  mcus_[mcu].poll_wanted = true;
  if (answer == ProgramLink::Answer::kNone) return;
  mcus_[mcu].answered = true;
  if (answer == ProgramLink::Answer::kRefused) listener_.refused(mcu, type, status);
}

}  // namespace bushd::link
