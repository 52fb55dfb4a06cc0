// Subcommands for the MCUs of motors.
#include <memory>

#include "commands.h"

namespace bushctl {
namespace {

namespace api = bushd::api;

// These are over in a moment, and only their result tells whether the MCUs did them.
template <class Request>
void add(CommandLine& line, const char* name, const char* text) {
  const auto motors = std::make_shared<api::MotorNames>();
  line.add(name, text)
      .words("NAME", motors.get(), kMotorsOrAll, Command::Needed::kNo)
      .run([&line, motors] {
        return send(line.connection(), Request{*motors}, bushd::client::Client::Until::kResult,
                    Hope::kDone);
      });
}

}  // namespace

void add_driver_commands(CommandLine& line) {
  add<api::Enable>(line, "enable", "Enable the motor drivers of these motors' MCUs");
  add<api::Disable>(line, "disable", "Disable the motor drivers of these motors' MCUs");
  add<api::ClearFaults>(line, "clear", "Clear faults of these motors' MCUs");
}

}  // namespace bushctl
