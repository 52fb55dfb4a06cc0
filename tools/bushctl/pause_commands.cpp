// Subcommands that pause motors on their way, and that hold them back.
#include <memory>

#include "commands.h"

namespace bushctl {
namespace {

namespace api = bushd::api;

template <class Request>
void add(CommandLine& commands, const std::string& name, const std::string& text,
         const std::string& footer) {
  const auto names = std::make_shared<api::MotorNames>();
  commands.add(name, text)
      .footer(footer)
      .words("NAME", names.get(), kMotorsOrAll, Command::Needed::kNo)
      .run([&commands, names] {
        return send(commands.connection(), Request{*names}, bushd::client::Client::Until::kResult,
                    Hope::kDone);
      });
}

}  // namespace

void add_pause_commands(CommandLine& commands) {
  add<api::Pause>(commands, "pause", "Ramp motors down, and keep their targets",
                  "Their moves stay open until 'resume', 'stop' or a new target. Jogs end.");
  add<api::Resume>(commands, "resume", "Let paused motors go on to their targets",
                   "Refused, as a whole, if one of them may not move.");
  add<api::Hold>(commands, "hold", "Let no motion of these motors begin",
                 "Until 'release'. What is under way goes on; 'pause' or 'stop' it.");
  add<api::Release>(commands, "release", "Let motors that are held move again",
                    "Motors that are paused stay so until 'resume'.");
}

}  // namespace bushctl
