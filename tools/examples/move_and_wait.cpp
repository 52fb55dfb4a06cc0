// Example of a client in C++: moves motors as one group and waits until all stand.
//
//   move_and_wait [--url URL] [--prefix PREFIX] NAME STEPS [NAME STEPS...]
//
// Prints every reply of the daemon; exit code 0 only if all motors reached their targets.
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "lcm/client.h"

namespace {

using bushd::command_t;
using bushd::reply_t;
using bushd::lcm::Client;
using bushd::lcm::ClientOptions;

void print(const reply_t& reply) {
  const char* phase = reply.phase == reply_t::ACCEPTED  ? "accepted"
                      : reply.phase == reply_t::REFUSED ? "refused"
                                                        : "result";
  std::cout << phase << ": " << reply.reason << std::endl;
  for (std::size_t i = 0; i < reply.motors.size(); ++i) {
    std::cout << "  " << reply.motors[i] << ": " << reply.motor_results[i] << ", stands at "
              << reply.position_steps[i] << std::endl;
  }
}

int usage() {
  std::cerr << "usage: move_and_wait [--url URL] [--prefix PREFIX] NAME STEPS [NAME STEPS...]\n";
  return 2;
}

int run(const std::vector<std::string>& arguments) {
  ClientOptions options{.program = "example-c++"};
  command_t command{};  // the braces matter: types made by lcm-gen do not initialise their numbers
  command.kind = command_t::MOVE_RELATIVE;
  if (arguments.size() % 2 != 0) return usage();
  for (std::size_t i = 0; i < arguments.size(); i += 2) {
    if (arguments[i] == "--url") {
      options.url = arguments[i + 1];
    } else if (arguments[i] == "--prefix") {
      options.prefix = arguments[i + 1];
    } else {
      command.motors.push_back(arguments[i]);
      command.steps.push_back(std::stoll(arguments[i + 1]));
    }
  }
  if (command.motors.empty()) return usage();

  auto client = Client::open(options);
  if (!client) {
    std::cerr << "move_and_wait: " << client.error().text() << "\n";
    return 1;
  }
  const auto reply = (*client)->run(command, Client::Until::kResult, print);
  if (!reply) {
    std::cerr << "move_and_wait: " << reply.error().text() << "\n";
    return 1;
  }
  return reply->result == "reached" ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception&) {  // STEPS that is no number
    return usage();
  }
}
