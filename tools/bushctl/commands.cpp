#include "commands.h"

#include <fmt/format.h>
#include <sys/signalfd.h>

#include <cmath>
#include <csignal>
#include <cstdio>

#include "base/printable.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;

// SIGINT and SIGTERM from a descriptor. Before LCM starts its thread, which inherits the mask.
int block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

bool as_hoped(const api::Reply& reply, Hope hope) {
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return std::holds_alternative<api::Accepted>(reply);
  return completed->outcome ==
         (hope == Hope::kReached ? api::Outcome::kReached : api::Outcome::kDone);
}

}  // namespace

int with_client(const Connection& connection, const std::function<int(Client&)>& action) {
  auto options = connection.options();
  options.interrupt_fd = block_signals();
  auto client = Client::open(std::move(options));
  if (!client) {
    fmt::print(stderr, "bushctl: {}\n", client.error().text());
    return kFailed;
  }
  return action(**client);
}

int failure(const Client& client, const bushd::Error& error) {
  if (client.interrupted()) return kInterrupted;
  fmt::print(stderr, "bushctl: {}\n", error.text());
  return kFailed;
}

int complete(const bushd::client::Status::Missing& missing, const char* things) {
  if (missing.count == 0) return kDone;
  fmt::print(stderr, "bushctl: {}\n", missing_text(missing, things));
  return kFailed;
}

int wrong_usage(const bushd::Error& error) {
  fmt::print(stderr, "bushctl: {}\n", error.text());
  return kUsage;
}

int refused(const api::Reply& reply) {
  if (const auto* completed = std::get_if<api::Completed>(&reply)) {
    fmt::print(stderr, "bushctl: {}: {}\n", word(completed->outcome),
               bushd::printable(completed->reason));
  } else if (const auto* refused = std::get_if<api::Refused>(&reply)) {
    fmt::print(stderr, "bushctl: refused: {}\n", bushd::printable(refused->reason));
  }
  return kFailed;
}

int send(const Connection& connection, const api::Request& request, Client::Until until,
         Hope hope) {
  return with_client(connection, [&](Client& client) {
    bool accepted = false;
    const auto reply = client.run(request, until, [&](const api::Reply& heard) {
      accepted = accepted || std::holds_alternative<api::Accepted>(heard);
      for (const std::string& line : lines(heard)) fmt::print("{}\n", line);
      std::fflush(stdout);
    });
    if (!reply) {
      if (client.interrupted() && accepted && hope == Hope::kReached) {
        const bool homes = std::holds_alternative<api::Home>(request);
        fmt::print(stderr, "bushctl: the {} goes on; 'bushctl stop' ends it\n",
                   homes ? "homing" : "move");
      }
      return failure(client, reply.error());
    }
    return as_hoped(*reply, hope) ? static_cast<int>(kDone) : refused(*reply);
  });
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::lround(seconds * 1000));
}

}  // namespace bushctl
