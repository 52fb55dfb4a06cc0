#include "daemon/services/program_words.h"

#include "motion/report_words.h"

namespace bushd::daemon {

using api::Outcome;

const char* stage_word(std::uint8_t stage) {
  switch (stage) {
    case BUSHD_PROGRAM_NONE:
      return "none";
    case BUSHD_PROGRAM_LOADING:
      return "loading";
    case BUSHD_PROGRAM_LOADED:
      return "loaded";
    case BUSHD_PROGRAM_WAITS:
      return "waits";
    case BUSHD_PROGRAM_RUNS:
      return "runs";
    case BUSHD_PROGRAM_PAUSES:
      return "pauses";
    case BUSHD_PROGRAM_PAUSED:
      return "paused";
    case BUSHD_PROGRAM_ENDS:
      return "ends";
    case BUSHD_PROGRAM_ENDED:
      return "ended";
    default:
      return "unknown";
  }
}

namespace {

std::string end_of_travel_text(std::uint8_t stage) {
  return stage == BUSHD_TRAVEL_NOT_LEFT ? "the limit switch that it came from is still active"
                                        : "its limit switch was not active after its last step";
}

}  // namespace

ProgramEnd end_of_program(const bushd_program_state& state, const Mcu& mcu) {
  switch (state.reason) {
    case BUSHD_PROGRAM_DONE:
      return {Outcome::kReached, "done"};
    case BUSHD_PROGRAM_STOPPED:
      return {Outcome::kStopped, "stopped on request"};
    case BUSHD_PROGRAM_FAULT:
      return {Outcome::kStopped, "ended because " + motion::stop_cause(mcu.report())};
    case BUSHD_PROGRAM_SILENCE:
      return {Outcome::kLink, "MCU " + mcu.name() +
                                  " ended it because it received nothing from the daemon; "
                                  "'bushctl clear', then run it again"};
    case BUSHD_PROGRAM_LIMIT:
      return {Outcome::kLimit, "a limit switch inhibits a direction in which it moves a motor"};
    case BUSHD_PROGRAM_RANGE:
      return {Outcome::kFault,
              "it leads a motor beyond where it may go; start it from elsewhere, or change it"};
    case BUSHD_PROGRAM_NO_INPUT:
      return {
          Outcome::kFault,
          "the input did not come within longest_s, or on the whole way of its move; look at the "
          "input, or allow more of either"};
    case BUSHD_PROGRAM_REFUSED:
      return {Outcome::kFault,
              "MCU " + mcu.name() +
                  " cannot make this motion as things are: another line, travel or "
                  "homing is under way, or a motor waits for the trigger; run it "
                  "again when they have ended"};
    case BUSHD_PROGRAM_DISABLED:
      return {Outcome::kStopped, "the drivers of MCU " + mcu.name() + " have been disabled"};
    case BUSHD_PROGRAM_LATE:
      return {Outcome::kFault, "bus time has changed before its start; run it again"};
    case BUSHD_PROGRAM_TRAVELLED:
      return {Outcome::kFault, end_of_travel_text(mcu.report().homing)};
    default:
      return {Outcome::kFault, "MCU " + mcu.name() + " does not say why it ended"};
  }
}

}  // namespace bushd::daemon
