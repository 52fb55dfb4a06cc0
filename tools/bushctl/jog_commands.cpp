// jog: a motor moves on for as long as this program keeps it going.
#include <fmt/format.h>
#include <unistd.h>

#include <memory>
#include <optional>

#include "base/parse_number.h"
#include "base/printable.h"
#include "commands.h"
#include "jog_panel.h"
#include "render.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Client;

struct JogOptions {
  std::vector<std::string> words;
  bool steps = false;
  std::uint32_t keepalive_ms = 500;
  std::int64_t pulses_after = 0;
  double speed = 0;  // of the keys
  double step = 0;
};

std::optional<double> number(const std::string& word) {
  return bushd::parse_number<double>(std::string_view(word).substr(word.starts_with('+') ? 1 : 0));
}

api::Jog jog_at(const JogOptions& options, double speed) {
  api::Jog jog{.motor = options.words[0],
               .per_s = speed,
               .in_steps = options.steps,
               .keepalive_ms = options.keepalive_ms};
  if (speed == 0 && options.pulses_after > 0) jog.steps_after = options.pulses_after;
  return jog;
}

std::chrono::milliseconds renewal(const JogOptions& options) {
  return std::chrono::milliseconds(options.keepalive_ms / 3);
}

void print_reply(const api::Reply& reply) {
  print_lines(lines(reply));
  std::fflush(stdout);
}

// Until Ctrl-C, or somebody else, ends it.
int jog(Client& client, const JogOptions& options, double speed) {
  Client::Meanwhile meanwhile;
  meanwhile.on_reply = print_reply;
  meanwhile.beside_every = renewal(options);
  meanwhile.beside = [&]() -> std::optional<api::Request> {
    return api::Jog{.motor = options.words[0], .renew = true};
  };
  meanwhile.on_interrupt = [&]() -> std::optional<api::Request> {
    take_interrupt();
    return jog_at(options, 0);
  };
  const auto reply = client.run(jog_at(options, speed), Client::Until::kResult, meanwhile);
  if (!reply) return failure(client, reply.error());
  const auto* completed = std::get_if<api::Completed>(&*reply);
  const bool done = completed != nullptr && completed->outcome == api::Outcome::kDone;
  return done ? static_cast<int>(kDone) : refused(*reply);
}

int run(const Connection& connection, JogOptions options) {
  if (options.words.size() > 2) {
    return wrong_usage({.message = "jog: write NAME SPEED, or NAME alone in a terminal"});
  }
  if (options.words.size() == 2) {
    const auto speed = number(options.words[1]);
    if (!speed) {
      return wrong_usage({.message = fmt::format("{}: \"{}\" is not a number", options.words[0],
                                                 options.words[1])});
    }
    // What ends the jog of others is answered when the motor stands.
    if (*speed == 0) return send(connection, jog_at(options, 0));
    return with_client(connection, [&](Client& client) { return jog(client, options, *speed); });
  }
  if (options.pulses_after > 0) {
    return wrong_usage({.message = "jog: --pulses-after needs SPEED; keys stop at once"});
  }
  if (isatty(STDIN_FILENO) == 0 || isatty(STDOUT_FILENO) == 0) {
    return wrong_usage(
        {.message = "jog: without SPEED it takes keys, and stdin or stdout is no terminal"});
  }
  take_hangup_too();  // first the motor is stopped
  return with_client(connection, [&](Client& client) {
    return JogPanel(client, {.motor = options.words[0],
                             .in_steps = options.steps,
                             .speed = options.speed,
                             .step = options.step,
                             .keepalive_ms = options.keepalive_ms})
        .run();
  });
}

}  // namespace

void add_jog_commands(CommandLine& commands) {
  const auto options = std::make_shared<JogOptions>();
  commands.add("jog", "Let a motor move on at a speed, until Ctrl-C")
      .footer(
          "bushctl jog NAME SPEED    at this speed in the motor's unit per second, negative: the "
          "other way, 0: end the jog of whoever jogs it\n"
          "bushctl jog NAME          by keys: left and right jog until another key stops, or a "
          "held one is let go; up and down move by a step; + - change the speed, * / the step; "
          "q ends\n"
          "The motor ramps down at its soft limit, and when this program ends, however it ends.")
      .words("NAME", &options->words, "The motor, and its speed", Command::Needed::kYes)
      .flag("--steps", &options->steps, "Numbers are steps, not the motor's unit")
      .number<double>("--speed", &options->speed, 1e-9, 1e9,
                      "First speed of the keys; else as its table starts")
      .number<double>("--step", &options->step, 1e-9, 1e9,
                      "First step of the keys; else a few steps")
      .number("--pulses-after", &options->pulses_after, api::Jog::kStepsAfter,
              "End so many steps after the stop event")
      .number("--keepalive-ms", &options->keepalive_ms, api::Jog::kKeepaliveMs,
              "Ramped down when nothing is heard of this program for so long")
      .run([&commands, options] { return run(commands.connection(), *options); });
}

}  // namespace bushctl
