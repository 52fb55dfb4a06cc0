#include "commands.h"

#include <fmt/format.h>

#include <cstdio>

#include "base/printable.h"
#include "render.h"

namespace bushctl {

using bushd::command_t;
using bushd::reply_t;
using bushd::lcm::Client;

int failure(const Client& client, const bushd::Error& error) {
  if (client.interrupted()) return kInterrupted;
  fmt::print(stderr, "bushctl: {}\n", error.text());
  return kFailed;
}

int show_status(Client& client, std::chrono::milliseconds timeout, bool as_json) {
  const auto snapshot = client.snapshot(timeout);
  if (!snapshot) return failure(client, snapshot.error());
  if (as_json) {
    fmt::print("{}\n", json(*snapshot));
  } else {
    for (const std::string& line : table(*snapshot)) fmt::print("{}\n", line);
  }
  return kDone;
}

int send(Client& client, const command_t& command, Client::Until until) {
  const bool homes = command.kind == command_t::HOME;
  const bool is_move = command.kind == command_t::MOVE_RELATIVE ||
                       command.kind == command_t::MOVE_ABSOLUTE || command.kind == command_t::ARM ||
                       homes;
  bool accepted = false;
  const auto reply = client.run(command, until, [&](const reply_t& heard) {
    accepted = accepted || heard.phase == reply_t::ACCEPTED;
    if (heard.phase == reply_t::REFUSED) return;
    for (const std::string& line : lines(heard)) fmt::print("{}\n", line);
    std::fflush(stdout);
  });
  if (!reply) {
    if (client.interrupted() && accepted && is_move) {
      fmt::print(stderr, "bushctl: the {} goes on; 'bushctl stop' ends it\n",
                 homes ? "homing" : "move");
    }
    return failure(client, reply.error());
  }
  if (reply->phase == reply_t::ACCEPTED) return kDone;
  if (reply->phase == reply_t::RESULT && reply->result == (is_move ? "reached" : "done"))
    return kDone;
  fmt::print(stderr, "bushctl: {}: {}\n", bushd::printable(reply->result),
             bushd::printable(reply->reason));
  return kFailed;
}

int show_plan(Client& client, command_t move, bool as_json) {
  move.dry_run = 1;
  const auto reply = client.run(move, Client::Until::kResult);
  if (!reply) return failure(client, reply.error());
  if (reply->phase != reply_t::RESULT || reply->plan.empty()) {
    fmt::print(stderr, "bushctl: {}: {}\n", bushd::printable(reply->result),
               bushd::printable(reply->reason));
    return kFailed;
  }
  if (as_json) {
    fmt::print("{}\n", json(reply->plan.front()));
  } else {
    for (const std::string& line : lines(reply->plan.front())) fmt::print("{}\n", line);
  }
  return kDone;
}

}  // namespace bushctl
