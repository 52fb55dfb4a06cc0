#include "commands.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <initializer_list>
#include <optional>

#include "base/printable.h"
#include "progress.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;
using bushd::client::detail_of;

// `fd`: of a former call; -1: none.
int block_signals(int fd, std::initializer_list<int> numbers) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : numbers) sigaddset(&signals, number);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(fd, &signals, SFD_CLOEXEC);
}

// The motors that it moves, all of which a stop would end; none of other requests.
api::MotorNames motors_of(const api::Request& request) {
  api::MotorNames names;
  const auto add = [&names](const std::vector<api::MotorAmount>& motors) {
    for (const api::MotorAmount& motor : motors) names.push_back(motor.motor);
  };
  if (const auto* move = std::get_if<api::Move>(&request)) add(move->motors);
  if (const auto* move = std::get_if<api::MoveLine>(&request)) add(move->motors);
  if (const auto* path = std::get_if<api::MovePath>(&request)) names = path->motors;
  if (const auto* arm = std::get_if<api::Arm>(&request)) add(arm->motors);
  if (const auto* arm = std::get_if<api::ArmLine>(&request)) add(arm->motors);
  if (const auto* home = std::get_if<api::Home>(&request)) names = home->motors;
  const auto* follow = std::get_if<api::Follow>(&request);
  if (follow != nullptr && follow->part == api::Follow::Part::kRun) names = follow->motors;
  return names;
}

// Ctrl-C stops them. Anything else lets them go on.
std::optional<api::Request> stop_on_interrupt(const api::MotorNames& motors) {
  signalfd_siginfo signal{};
  if (read(signal_descriptor(), &signal, sizeof signal) != sizeof signal ||
      signal.ssi_signo != SIGINT) {
    return std::nullopt;
  }
  fmt::print(stderr, "bushctl: ramping down; Ctrl-C again does not wait for that\n");
  return api::Stop{motors};
}

bool as_hoped(const api::Reply& reply, Hope hope) {
  const auto* completed = std::get_if<api::Completed>(&reply);
  if (completed == nullptr) return std::holds_alternative<api::Accepted>(reply);
  if (hope == Hope::kReached) return completed->outcome == api::Outcome::kReached;
  const bool done = completed->outcome == api::Outcome::kDone;
  return done && (hope == Hope::kDone || completed->reason == word(api::Outcome::kDone));
}

}  // namespace

int signal_descriptor() {
  static const int fd = block_signals(-1, {SIGINT, SIGTERM});
  return fd;
}

void take_hangup_too() {
  block_signals(signal_descriptor(), {SIGINT, SIGTERM, SIGHUP});
}

bool take_interrupt() {
  pollfd waits{.fd = signal_descriptor(), .events = POLLIN, .revents = 0};
  if (poll(&waits, 1, 0) <= 0) return false;
  signalfd_siginfo signal{};
  return read(signal_descriptor(), &signal, sizeof signal) == sizeof signal;
}

int with_client(const Connection& connection, const std::function<int(Client&)>& action) {
  auto options = connection.options();
  options.interrupt_fd = signal_descriptor();
  auto client = Client::open(std::move(options));
  if (!client) return failed(client.error());
  if (const std::string& why = (*client)->barred(); !why.empty()) {
    fmt::print(stderr, "bushctl: {}; LCM is used meanwhile\n", bushd::printable(why));
  }
  return action(**client);
}

int failure(const Client& client, const bushd::Error& error) {
  return client.interrupted() ? static_cast<int>(kInterrupted) : failed(error);
}

int complete(const bushd::client::Status& status, const bushd::client::Status::Missing& missing,
             const char* things) {
  if (missing.count == 0) return kDone;
  fmt::print(stderr, "bushctl: {}\n", missing_text(status.answered, missing, things));
  return kFailed;
}

int wrong_usage(const bushd::Error& error) {
  failed(error);
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

namespace {

api::Reply worded(api::Reply reply, const Wording& wording) {
  if (auto* refused = std::get_if<api::Refused>(&reply); refused != nullptr && wording) {
    refused->reason = wording(refused->reason);
  }
  return reply;
}

// Tells a path; kDone if all of its points but those of the last request are taken.
int bring(Client& client, const std::vector<api::MovePath>& parts, const Wording& wording) {
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    const auto reply = client.run(parts[i], Client::Until::kResult);
    if (!reply) return failure(client, reply.error());
    if (!as_hoped(*reply, Hope::kDone)) return refused(worded(*reply, wording));
  }
  return kDone;
}

}  // namespace

int send(Client& client, const Sending& sending) {
  const auto& [request, until, hope, wording, given] = sending;
  const api::MotorNames motors = given.empty() ? motors_of(request) : given;
  const auto* home = std::get_if<api::Home>(&request);
  const bool moves = !motors.empty() || (home != nullptr && home->all);
  bool accepted = false;
  bool stopped = false;
  Progress progress(motors);
  Client::Meanwhile meanwhile;
  meanwhile.on_reply = [&](const api::Reply& heard) {
    accepted = accepted || std::holds_alternative<api::Accepted>(heard);
    progress.clear();
    print_lines(lines(heard));
    print_lines(rounding_lines(request, heard));
    // What limits a line, and how near to it the motors are; at which frame a program has ended.
    const auto* completed = std::get_if<api::Completed>(&heard);
    const bool tells_more = std::holds_alternative<api::MoveLine>(request) ||
                            std::holds_alternative<api::ArmLine>(request) ||
                            std::holds_alternative<api::RunPrograms>(request);
    if (completed != nullptr && tells_more && as_hoped(heard, hope)) {
      fmt::print("{}\n", bushd::printable(completed->reason));
    }
    std::fflush(stdout);
  };
  if (until == Client::Until::kResult && moves) {
    meanwhile.on_state = [&](const bushd::client::Status& status) { progress.show(status); };
    meanwhile.on_interrupt = [&] {
      progress.clear();
      auto stop = stop_on_interrupt(motors);
      stopped = stop.has_value();
      return stop;
    };
  }
  const auto reply = client.run(request, until, meanwhile);
  progress.clear();
  if (reply && as_hoped(*reply, hope)) return static_cast<int>(kDone);
  if (!reply && client.interrupted() && stopped) {
    fmt::print(stderr, "bushctl: the stop was sent; 'bushctl where' shows where motors stand\n");
  } else if (!reply && client.interrupted() && accepted && moves) {
    const bool runs = std::holds_alternative<api::RunPrograms>(request);
    fmt::print(stderr, "bushctl: the {} goes on; 'bushctl stop' ends it\n",
               home != nullptr ? "homing"
               : runs          ? "program"
                               : "move");
  }
  const int code = reply ? refused(worded(*reply, wording)) : failure(client, reply.error());
  return stopped ? static_cast<int>(kInterrupted) : code;
}

int send(Client& client, const api::Request& request, Client::Until until, Hope hope) {
  return send(client, Sending{.request = request, .until = until, .hope = hope});
}

int send(const Connection& connection, const api::Request& request, Client::Until until,
         Hope hope) {
  return with_client(connection,
                     [&](Client& client) { return send(client, request, until, hope); });
}

int send_parts(const Connection& connection, const std::vector<api::MovePath>& parts,
               Client::Until until, const Wording& wording) {
  return with_client(connection, [&](Client& client) {
    if (const int code = bring(client, parts, wording); code != kDone) return code;
    return send(
        client,
        Sending{
            .request = parts.back(), .until = until, .hope = Hope::kReached, .wording = wording});
  });
}

int show_plan(const Connection& connection, std::vector<api::MovePath> parts, bool as_json,
              const Wording& wording) {
  for (api::MovePath& part : parts) part.dry_run = true;
  return with_client(connection, [&](Client& client) {
    if (const int code = bring(client, parts, wording); code != kDone) return code;
    const auto reply = client.run(parts.back(), Client::Until::kResult);
    if (!reply) return failure(client, reply.error());
    const auto* plan = detail_of<api::MovePlan>(reply);
    if (plan == nullptr) return refused(worded(*reply, wording));
    return print(*plan, as_json);
  });
}

int print(const api::MovePlan& plan, bool as_json) {
  print_lines(as_json ? std::vector{json(plan)} : lines(plan));
  return kDone;
}

void print_lines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) fmt::print("{}\n", line);
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::lround(seconds * 1000));
}

int failed(const bushd::Error& error) {
  fmt::print(stderr, "bushctl: {}\n", bushd::printable(error.text()));
  return kFailed;
}

std::int64_t unix_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

}  // namespace bushctl
