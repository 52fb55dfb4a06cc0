// What is wrong in a lab, from what was seen, and what to do about it. No I/O and no clock.
#pragma once

#include <string>
#include <vector>

#include "observations.h"

namespace bushctl::doctor {

enum class Level { kOk, kWarning, kError };
const char* word(Level level);  // ok warning error

struct Finding {
  Level level = Level::kOk;
  // configuration, port, lcm, clock, disk, socket, daemon, mcu, line, position
  std::string check{};
  std::string seen{};    // what it is about, and what was seen
  std::string remedy{};  // "" where nothing is wrong
  // Where the same may be found of many things: which one it is, and what is told of several at
  // once, "motors are uncertain".
  std::string about{};
  std::string of_several{};
};
using Findings = std::vector<Finding>;

// All of them, in the order in which people look.
Findings diagnose(const Observations& seen);

// Parts of it.
Findings check_configuration(const Observations& seen);
Findings check_ports(const Observations& seen);
Findings check_lcm(const Observations& seen);
Findings check_clock(const Observations& seen);
Findings check_disk(const Observations& seen);
Findings check_sockets(const Observations& seen);
Findings check_daemon(const Observations& seen);
Findings check_mcus(const Observations& seen);
Findings check_buses(const Observations& seen);
Findings check_positions(const Observations& seen);

// Lines for a terminal, the last of which sums up. What is found of more than three is told once.
std::vector<std::string> lines(const Findings& findings);
// {"findings":[{"level","check","seen","remedy"}],"errors":1,"warnings":0}; no remedy: null.
std::string json(const Findings& findings);
bool any_error(const Findings& findings);

}  // namespace bushctl::doctor
