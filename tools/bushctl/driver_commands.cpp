// Subcommands for the MCUs of motors.
#include <memory>

#include "commands.h"

namespace bushctl {
namespace {

namespace api = bushd::api;

// These are over in a moment, and only their result tells whether the MCUs did them.
template <class Request>
void add(CommandLine& commands, const char* name, const char* text) {
  const auto motors = std::make_shared<api::MotorNames>();
  commands.add(name, text)
      .words("NAME", motors.get(), kMotorsOrAll, Command::Needed::kNo)
      .run([&commands, motors] {
        return send(commands.connection(), Request{*motors}, bushd::client::Client::Until::kResult,
                    Hope::kDone);
      });
}

}  // namespace

void add_driver_commands(CommandLine& commands) {
  add<api::Enable>(commands, "enable", "Enable the motor drivers of these motors' MCUs");
  add<api::Disable>(commands, "disable", "Disable the motor drivers of these motors' MCUs");
  add<api::ClearFaults>(commands, "clear", "Clear faults of these motors' MCUs");
}

}  // namespace bushctl
