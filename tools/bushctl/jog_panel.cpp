#include "jog_panel.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>

#include "base/printable.h"
#include "commands.h"
#include "named_motors.h"
#include "progress.h"
#include "render.h"
#include "tables/table.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using Course = JogKeys::Course;

constexpr std::chrono::milliseconds kStatusWithin{4000};
// How late it is noticed at most that a key was let go, or that a sign of life is due.
constexpr std::chrono::milliseconds kLook{50};

// States come twice a second at least.
constexpr std::chrono::seconds kSilent{3};
constexpr const char* kClearLine = "\r\x1b[K";

JogKeys::Time now() {
  const auto since_boot = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<JogKeys::Time>(since_boot);
}

// What is not written is not seen: a terminal may be gone, and the motor is to be stopped then.
void write(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

std::string table_name(const api::TableRef& table) {
  return table.revision > 0 ? fmt::format("{}@{}", table.name, table.revision) : table.name;
}

}  // namespace

JogPanel::JogPanel(Client& client, JogPanelOptions options)
    : client_(client), options_(std::move(options)) {}

int JogPanel::run() {
  if (!find_motor()) return kFailed;
  write(fmt::format(
      "{}: left and right jog until another key stops, or a held one is let go\n"
      "up and down move by a step; + and - double and halve the speed, * and / the step\n"
      "q or Ctrl-C ends\n",
      bushd::printable(options_.motor)));
  terminal_.emplace();
  draw();
  while (!over_) {
    wait_at_rest();
    if (take_interrupt()) keys_.quit();
    hear_daemon();
    read_keys();
    change_speed();
    if (keys_.take_suspension()) suspend();
    over_ = over_ || keys_.quits();
    if (over_) break;
    const Course course = keys_.course();
    if (course == Course::kLeft || course == Course::kRight) jog();
    if (course == Course::kUp || course == Course::kDown) make_step();
  }
  write(kClearLine);
  return result_;
}

// Says why if it cannot be jogged.
bool JogPanel::find_motor() {
  const auto status = client_.status(kStatusWithin);
  if (!status) {
    failure(client_, status.error());
    return false;
  }
  take(*status);
  for (const auto& mcu : status->descriptions) {
    for (const api::MotorDescription& motor : mcu.snapshot.motors) {
      if (motor.name == options_.motor) return find_amounts(motor);
    }
  }
  failed({.message = no_such_motor(*status, options_.motor)});
  return false;
}

bool JogPanel::find_amounts(const api::MotorDescription& motor) {
  const auto reply =
      client_.run(api::GetTable{.table = table_name(motor.table)}, Client::Until::kResult);
  if (!reply) {
    failure(client_, reply.error());
    return false;
  }
  const auto* completed = std::get_if<api::Completed>(&*reply);
  const auto* file =
      completed == nullptr ? nullptr : std::get_if<api::TableFile>(&completed->detail);
  const auto* table = file == nullptr ? nullptr : &file->content;
  if (table != nullptr && bushd::tables::check(*table)) table = nullptr;
  amounts_ = jog_amounts(table, motor.scale, options_.in_steps);
  if (options_.speed > 0) amounts_.speed = options_.speed;
  if (options_.step > 0) amounts_.step = options_.step;
  if (amounts_.speed > 0) return true;
  failed({.message = fmt::format("{}: its table cannot be read, so a slow speed is not known: give "
                                 "one with --speed",
                                 options_.motor)});
  return false;
}

// Until there is something to do.
void JogPanel::wait_at_rest() {
  std::array<pollfd, 3> polled{{{.fd = RawTerminal::fd(), .events = POLLIN, .revents = 0},
                                {.fd = signal_descriptor(), .events = POLLIN, .revents = 0},
                                {.fd = client_.link().fd(), .events = POLLIN, .revents = 0}}};
  const bool key_waits = keys_.wake() != JogKeys::Time::max();
  const auto most = key_waits ? kLook : std::chrono::milliseconds(kSilent);
  if (poll(polled.data(), polled.size(), static_cast<int>(most.count())) == 0 && is_silent())
    draw();
}

void JogPanel::hear_daemon() {
  const auto status = client_.next_state(std::chrono::milliseconds(0));
  if (status) return take(*status);
  if (!client_.ended()) return;
  say(bushd::printable(status.error().text()));
  over_ = true;
  result_ = kFailed;
}

void JogPanel::read_keys() {
  const auto bytes = terminal_->read_all();
  keys_.read(now(), bytes.value_or(""));
  if (!bytes) keys_.quit();
  const int step = keys_.take_step_change();
  if (step == 0) return;
  amounts_.change_step(step);
  draw();
}

// Whether there was one.
bool JogPanel::change_speed() {
  const int speed = keys_.take_speed_change();
  if (speed == 0) return false;
  amounts_.change_speed(speed);
  draw();
  return true;
}

void JogPanel::suspend() {
  write(kClearLine);
  terminal_->suspend();
  draw();
}

api::Jog JogPanel::jog_at(double speed) const {
  return {.motor = options_.motor,
          .per_s = speed,
          .in_steps = options_.in_steps,
          .keepalive_ms = options_.keepalive_ms};
}

std::chrono::milliseconds JogPanel::renewal() const {
  return std::chrono::milliseconds(options_.keepalive_ms / 3);
}

void JogPanel::jog() {
  const double sign = keys_.course() == Course::kRight ? 1 : -1;
  renewed_at_ = Clock::now();
  run_one(jog_at(sign * amounts_.speed), jog_at(0), [&]() -> std::optional<api::Request> {
    const bool changed = change_speed();
    if (!changed && Clock::now() < renewed_at_ + renewal()) return std::nullopt;
    renewed_at_ = Clock::now();
    if (changed) return jog_at(sign * amounts_.speed);
    return api::Jog{.motor = options_.motor, .renew = true};
  });
}

void JogPanel::make_step() {
  const double step = keys_.course() == Course::kUp ? amounts_.step : -amounts_.step;
  const api::Amount amount = options_.in_steps
                                 ? api::Amount(static_cast<std::int64_t>(std::llround(step)))
                                 : api::Amount(api::UserUnits{step});
  const api::Speed speed{.per_s = amounts_.speed, .in_steps = options_.in_steps};
  run_one(api::Move{.motors = {{options_.motor, amount}}, .speed = speed},
          api::Stop{{options_.motor}}, [] { return std::nullopt; });
}

void JogPanel::run_one(const api::Request& request, const api::Request& ending,
                       const std::function<std::optional<api::Request>()>& beside) {
  Client::Meanwhile meanwhile;
  meanwhile.on_state = [&](const Status& status) { take(status); };
  meanwhile.beside_fd = RawTerminal::fd();
  meanwhile.beside_every = std::min(kLook, renewal());
  meanwhile.beside = [&]() -> std::optional<api::Request> {
    read_keys();
    if (is_silent()) draw();
    return keys_.course() == Course::kStopping ? std::nullopt : beside();
  };
  meanwhile.end = [&] {
    return keys_.course() == Course::kStopping ? std::optional(ending) : std::nullopt;
  };
  meanwhile.on_interrupt = [&]() -> std::optional<api::Request> {
    take_interrupt();
    keys_.quit();
    return ending;
  };
  has_ended(client_.run(request, Client::Until::kResult, meanwhile));
}

void JogPanel::has_ended(const bushd::Result<api::Reply>& reply) {
  read_keys();  // what was pressed while it ramped down is not for later
  if (!reply) {
    over_ = true;
    result_ = client_.interrupted() ? kInterrupted : kFailed;
    return say(client_.interrupted() ? "not waited for; 'bushctl where' shows where it stands"
                                     : bushd::printable(reply.error().text()));
  }
  const auto* completed = std::get_if<api::Completed>(&*reply);
  const bool as_asked = completed != nullptr && (completed->outcome == api::Outcome::kDone ||
                                                 completed->outcome == api::Outcome::kReached);
  keys_.rests(now(), as_asked);
  if (const auto* refused = std::get_if<api::Refused>(&*reply)) {
    return say("refused: " + bushd::printable(refused->reason));
  }
  if (completed == nullptr) return;
  std::string_view why = completed->reason;
  if (why.starts_with(options_.motor + ": ")) why.remove_prefix(options_.motor.size() + 2);
  for (const std::string& line : lines(*reply)) say(line + ": " + bushd::printable(why));
}

// What is shown is old then.
bool JogPanel::is_silent() const {
  return Clock::now() > heard_at_ + kSilent;
}

void JogPanel::take(const Status& status) {
  heard_at_ = Clock::now();
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const auto& motors = status.states[i].snapshot.motors;
    for (std::size_t m = 0; m < motors.size(); ++m) {
      if (motors[m].name != options_.motor) continue;
      stands_ = stand_text(status, i, m);
      bounds_ = bounds_text(status, i, m);
    }
  }
  if (terminal_) draw();
}

void JogPanel::draw() {
  const std::string line =
      fmt::format("{} {} | speed {:.4g} {}/s, step {:.4g} | {}", bushd::printable(options_.motor),
                  is_silent() ? "no state from bushd" : stands_, amounts_.speed,
                  bushd::printable(amounts_.unit), amounts_.step, bounds_);
  write(fmt::format("\r{:.{}}\x1b[K", line, columns_of_terminal(STDOUT_FILENO)));
}

void JogPanel::say(const std::string& text) {
  write(kClearLine + text + "\n");
  draw();
}

}  // namespace bushctl
