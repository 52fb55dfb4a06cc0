// Subcommands that name motors and nothing else. They are over in a moment, and only their result
// tells whether it is done.
#include <memory>

#include "commands.h"

namespace bushctl {
namespace {

namespace api = bushd::api;

template <class Request>
void add(CommandLine& commands, const char* name, const char* text, const char* footer = "",
         Command::Needed motors_are = Command::Needed::kNo) {
  const auto motors = std::make_shared<api::MotorNames>();
  commands.add(name, text)
      .footer(footer)
      .words("NAME", motors.get(), motors_are == Command::Needed::kNo ? kMotorsOrAll : kMotors,
             motors_are)
      .run([&commands, motors] { return send(commands.connection(), Request{*motors}); });
}

}  // namespace

void add_disarm_command(CommandLine& commands) {
  add<api::Disarm>(commands, "disarm", "Cancel moves that wait for the trigger",
                   "What waits for the same trigger, or was armed together, is disarmed together.");
}

void add_plain_commands(CommandLine& commands) {
  add<api::Pause>(commands, "pause", "Ramp motors down, and keep their targets",
                  "Their moves stay open until 'resume', 'stop' or a new target. Jogs end.");
  add<api::Resume>(commands, "resume", "Let paused motors go on to their targets",
                   "Refused, as a whole, if one of them may not move.");
  add<api::Hold>(commands, "hold", "Let no motion of these motors begin",
                 "Until 'release'. What is under way goes on; 'pause' or 'stop' it.");
  add<api::Release>(commands, "release", "Let motors that are held move again",
                    "Motors that are paused stay so until 'resume'.");
  add<api::Enable>(commands, "enable", "Enable the motor drivers of these motors' MCUs");
  add<api::Disable>(commands, "disable", "Disable the motor drivers of these motors' MCUs");
  add<api::ClearFaults>(commands, "clear", "Clear faults of these motors' MCUs");
  add<api::Confirm>(
      commands, "confirm", "Confirm that motors stand where they are shown",
      "Positions that are restored or uncertain ('bushctl where') are known then, and nothing "
      "moves. Where a motor stands elsewhere, use 'set' or 'home'.",
      Command::Needed::kYes);
}

}  // namespace bushctl
