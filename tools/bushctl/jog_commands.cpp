// jog: a motor moves on for as long as this program keeps it going.
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <csignal>
#include <memory>
#include <optional>
#include <utility>

#include "base/printable.h"
#include "commands.h"
#include "keys.h"
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
  double speed = 100;  // of the keys, in steps unless given in units
  double step = 10;
};

std::optional<double> number(const std::string& word) {
  double value = 0;
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
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
  for (const std::string& line : lines(reply)) fmt::print("{}\n", line);
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

// Arrow keys left and right jog, up and down move by a step.
class Panel {
 public:
  Panel(Client& client, const JogOptions& options) : client_(client), options_(options) {}

  int run() {
    fmt::print(
        "{}: left and right jog, up and down move by a step, + and - double and halve the speed "
        "while it jogs, else the step; any other key stops. Ctrl-C ends\n",
        bushd::printable(options_.words[0]));
    while (!over_) {
      const auto key = next_ ? std::exchange(next_, std::nullopt) : keys_.next(kKeyMs);
      if (take_interrupt()) break;
      if (key) act_on(*key);
    }
    return result_;
  }

 private:
  static constexpr int kKeyMs = 100;

  void act_on(Key key) {
    switch (key) {
      case Key::kEnd:
        over_ = true;
        break;
      case Key::kLeft:
      case Key::kRight:
        jog(key == Key::kRight ? options_.speed : -options_.speed);
        break;
      case Key::kUp:
      case Key::kDown:
        move(key == Key::kUp ? options_.step : -options_.step);
        break;
      case Key::kPlus:
      case Key::kMinus:
        options_.step = scaled(options_.step, key);
        fmt::print("step {:g}\n", options_.step);
        break;
      case Key::kOther:
        break;
    }
    std::fflush(stdout);
  }

  double scaled(double value, Key key) const {
    const double other = key == Key::kPlus ? value * 2 : value / 2;
    return options_.steps && std::abs(other) < 1 ? value : other;
  }

  void jog(double speed) {
    bool ends = false;
    Client::Meanwhile meanwhile;
    meanwhile.on_reply = print_reply;
    meanwhile.beside_every = std::min(renewal(options_), std::chrono::milliseconds(kKeyMs));
    meanwhile.beside = [&]() -> std::optional<api::Request> {
      if (ends) return std::nullopt;
      const auto key = keys_.next(0);
      if (!key) return api::Jog{.motor = options_.words[0], .renew = true};
      const double before = speed;
      if (*key == Key::kRight) speed = options_.speed;
      if (*key == Key::kLeft) speed = -options_.speed;
      if (*key == Key::kPlus || *key == Key::kMinus) {
        options_.speed = scaled(options_.speed, *key);
        speed = std::copysign(options_.speed, before);
      }
      ends = *key == Key::kUp || *key == Key::kDown || *key == Key::kOther || *key == Key::kEnd;
      over_ = over_ || *key == Key::kEnd;
      return jog_at(options_, ends ? 0 : speed);
    };
    run_one(jog_at(options_, speed), std::move(meanwhile), jog_at(options_, 0));
  }

  // Any key but the arrow that has begun it stops it.
  void move(double distance) {
    const api::Amount amount = options_.steps
                                   ? api::Amount(static_cast<std::int64_t>(std::llround(distance)))
                                   : api::Amount(api::UserUnits{distance});
    const api::Stop stop{{options_.words[0]}};
    Client::Meanwhile meanwhile;
    meanwhile.on_reply = print_reply;
    meanwhile.beside = [&]() -> std::optional<api::Request> {
      const auto key = keys_.next(0);
      if (!key) return std::nullopt;
      over_ = over_ || *key == Key::kEnd;
      // A key that is kept pressed makes one step after the other.
      const bool again = *key == (distance > 0 ? Key::kUp : Key::kDown);
      if (again) next_ = key;
      return again ? std::optional<api::Request>() : stop;
    };
    run_one(api::Move{.motors = {{options_.words[0], amount}}}, std::move(meanwhile), stop);
  }

  void run_one(const api::Request& request, Client::Meanwhile meanwhile,
               const api::Request& ending) {
    meanwhile.on_interrupt = [&]() -> std::optional<api::Request> {
      take_interrupt();
      over_ = true;
      return ending;
    };
    const auto reply = client_.run(request, Client::Until::kResult, meanwhile);
    if (!reply) {
      over_ = true;
      result_ = failure(client_, reply.error());
    } else if (std::holds_alternative<api::Refused>(*reply)) {
      refused(*reply);
    }
  }

  Client& client_;
  JogOptions options_;
  Keys keys_;
  std::optional<Key> next_;
  bool over_ = false;
  int result_ = kDone;
};

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
    if (*speed == 0)
      return send(connection, jog_at(options, 0), Client::Until::kResult, Hope::kDone);
    return with_client(connection, [&](Client& client) { return jog(client, options, *speed); });
  }
  if (isatty(STDIN_FILENO) == 0) {
    return wrong_usage({.message = "jog: without SPEED it takes keys, and stdin is no terminal"});
  }
  // A terminal that hangs up is seen by its end; first the motor is stopped.
  std::signal(SIGHUP, SIG_IGN);
  return with_client(connection, [&](Client& client) { return Panel(client, options).run(); });
}

}  // namespace

void add_jog_commands(CommandLine& line) {
  const auto options = std::make_shared<JogOptions>();
  line.add("jog", "Let a motor move on at a speed, until Ctrl-C")
      .footer(
          "bushctl jog NAME SPEED    at this speed in the motor's unit per second, negative: the "
          "other way, 0: end the jog of whoever jogs it\n"
          "bushctl jog NAME          by keys: arrows jog and move by a step, + and - change speed "
          "and step, any other key stops\n"
          "The motor ramps down at its soft limit, and when this program ends, however it ends.")
      .words("NAME", &options->words, "The motor, and its speed", Command::Needed::kYes)
      .flag("--steps", &options->steps, "Numbers are steps, not the motor's unit")
      .number<double>("--speed", &options->speed, 1e-9, 1e9, "First speed of the keys")
      .number<double>("--step", &options->step, 1e-9, 1e9, "First step of the keys")
      .number<std::int64_t>("--pulses-after", &options->pulses_after, 0, 2'147'483'647,
                            "End so many steps after the stop event")
      .number<std::uint32_t>("--keepalive-ms", &options->keepalive_ms, 50, 10'000,
                             "Ramped down when nothing is heard of this program for so long")
      .run([&line, options] { return run(line.connection(), *options); });
}

}  // namespace bushctl
