// Example of a client in C++: moves motors as one group and waits until all stand.
//
//   move_and_wait [--socket PATH | --url URL] [--prefix PREFIX] NAME DISTANCE [NAME DISTANCE...]
//
// Prints every reply of the daemon; exit code 0 only if all motors reached their targets.
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "client/client.h"

namespace {

namespace api = bushd::api;
using bushd::client::Client;
using bushd::client::ClientOptions;

void print(const api::Reply& reply) {
  if (std::holds_alternative<api::Accepted>(reply)) std::cout << "accepted" << std::endl;
  if (const auto* refused = std::get_if<api::Refused>(&reply)) {
    std::cout << "refused: " << refused->reason << std::endl;
  }
  if (const auto* completed = std::get_if<api::Completed>(&reply)) {
    std::cout << word(completed->outcome) << ": " << completed->reason << std::endl;
    const auto* motors = std::get_if<std::vector<api::MotorResult>>(&completed->detail);
    if (motors == nullptr) return;
    for (const api::MotorResult& motor : *motors) {
      std::cout << "  " << motor.motor << ": " << word(motor.outcome) << ", stands at "
                << motor.user << " " << motor.unit << std::endl;
    }
  }
}

int usage() {
  std::cerr << "usage: move_and_wait [--socket PATH | --url URL] [--prefix PREFIX] NAME "
               "DISTANCE [NAME DISTANCE...]\n";
  return 2;
}

int run(const std::vector<std::string>& arguments) {
  // By the control socket, unless LCM is asked for.
  ClientOptions options{.program = "example-c++"};
  api::Move move;  // by distances in the motors' units
  if (arguments.size() % 2 != 0) return usage();
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    const std::string& value = arguments[i + 1];
    if (arguments[i] == "--socket") {
      options.way = ClientOptions::Way::kSocket;
      options.socket = value;
    } else if (arguments[i] == "--url" || arguments[i] == "--prefix") {
      options.way = ClientOptions::Way::kLcm;
      (arguments[i] == "--url" ? options.url : options.prefix) = value;
    } else {
      move.motors.push_back({arguments[i], api::UserUnits{std::stod(value)}});
    }
  }
  if (move.motors.empty()) return usage();

  const auto client = Client::open(options);
  if (!client) {
    std::cerr << "move_and_wait: " << client.error().text() << "\n";
    return 1;
  }
  const auto reply = (*client)->run(move, Client::Until::kResult, {.on_reply = print});
  if (!reply) {
    std::cerr << "move_and_wait: " << reply.error().text() << "\n";
    return 1;
  }
  const auto* completed = std::get_if<api::Completed>(&*reply);
  return completed != nullptr && completed->outcome == api::Outcome::kReached ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception&) {  // DISTANCE that is no number
    return usage();
  }
}
