// What bushctl's subcommands do. All return the exit code.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "bushd/command_t.hpp"
#include "lcm/client.h"

namespace bushctl {

enum Exit : int {
  kDone = 0,
  kFailed = 1,  // refused, no daemon, or a result other than hoped for; stderr says which
  kUsage = 2,
  kInterrupted = 130
};

int show_status(bushd::lcm::Client& client, std::chrono::milliseconds timeout, bool as_json);

// kAnswered: done when accepted. kResult: done when every motor reached its target, or the command
// was carried out.
int send(bushd::lcm::Client& client, const bushd::command_t& command,
         bushd::lcm::Client::Until until);

// What the move would be.
int show_plan(bushd::lcm::Client& client, bushd::command_t move, bool as_json);

struct WatchOptions {
  std::chrono::milliseconds timeout{2000};  // without a snapshot
  std::optional<unsigned> count;            // snapshots to show; none: until interrupted
};
int watch(bushd::lcm::Client& client, const WatchOptions& options);

struct HealthOptions {
  std::chrono::milliseconds timeout{2000};
  bool json = false;
  bool watch = false;
  std::optional<unsigned> count;  // with `watch`: messages to show; none: until interrupted
};
int show_health(bushd::lcm::Client& client, const HealthOptions& options);

// All tables that the daemon finds, and which each group has; what one of them says.
int list_tables(bushd::lcm::Client& client, bool as_json);
int show_table(bushd::lcm::Client& client, const std::string& wanted, bool as_json);

// Says on stderr why, unless it was the user who broke off.
int failure(const bushd::lcm::Client& client, const bushd::Error& error);

}  // namespace bushctl
