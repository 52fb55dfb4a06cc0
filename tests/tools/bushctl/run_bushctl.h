// bushctl as a user runs it, and what a fake daemon answers and is asked.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "client/client.h"
#include "tools/bushctl/fake_daemon.h"
#include "tools/bushctl/program.h"

namespace bushctl::test {

struct Ran {
  int code;
  std::string out;
  std::string err;
};

inline std::vector<std::string> with_program(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), BUSHCTL);
  return arguments;
}

inline Ran bushctl(const std::vector<std::string>& arguments) {
  Program program(with_program(arguments));
  const int code = program.finish();
  return {code, program.out(), program.err()};
}

// A program that finds no control socket asks the fake daemon then.
inline void use_lcm() {
  setenv("LCM_DEFAULT_URL", bushd::client::kDefaultUrl, 1);
}

using Replies = std::vector<api::Reply>;

// To nothing that it is asked.
inline FakeDaemon::Answer silent() {
  return {};
}
inline FakeDaemon::Answer always(api::Outcome outcome) {
  return [outcome](const api::Request& request, int) {
    return Replies{api::Accepted{}, result(request, outcome)};
  };
}

// The only request, of this type.
template <class Request>
Request only(const FakeDaemon& daemon) {
  const auto requests = daemon.requests();
  EXPECT_EQ(requests.size(), 1u);
  return std::get<Request>(requests.at(0));
}

// Amounts of motors without a unit.
inline std::vector<api::MotorAmount> user(
    const std::vector<std::pair<std::string, double>>& motors) {
  std::vector<api::MotorAmount> out;
  for (const auto& [motor, value] : motors) out.push_back({motor, api::UserUnits{value}});
  return out;
}

}  // namespace bushctl::test
