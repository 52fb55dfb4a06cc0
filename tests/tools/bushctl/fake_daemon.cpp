#include "tools/bushctl/fake_daemon.h"

#include <poll.h>

#include <chrono>
#include <stdexcept>

#include "lcm/client.h"
#include "lcm/messages.h"

namespace bushctl::test {

using bushd::command_t;
using bushd::reply_t;
using bushd::state_t;

FakeDaemon::FakeDaemon() {
  auto transport = bushd::lcm::Transport::open(bushd::lcm::kDefaultUrl);
  if (!transport) throw std::runtime_error(transport.error().text());
  transport_ = std::move(*transport);
}

FakeDaemon::~FakeDaemon() {
  ended_ = true;
  if (thread_.joinable()) thread_.join();
}

void FakeDaemon::start(Answer answer) {
  answer_ = std::move(answer);
  transport_->subscribe<command_t>("BUSHD_COMMAND",
                                   [this](const command_t& command) { on_command(command); });
  thread_ = std::thread([this] { run(); });
}

std::vector<command_t> FakeDaemon::commands() const {
  const std::lock_guard lock(mutex_);
  return commands_;
}

void FakeDaemon::run() {
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_state = Clock::now();
  while (!ended_) {
    pollfd polled{.fd = transport_->fd(), .events = POLLIN, .revents = 0};
    poll(&polled, 1, 5);
    transport_->handle();
    if (Clock::now() < next_state) continue;
    publish_state();
    next_state = Clock::now() + std::chrono::milliseconds(20);
  }
}

void FakeDaemon::publish_state() {
  const std::int64_t sequence = ++sequence_;
  for (std::int32_t part = 0; part < 2; ++part) {
    state_t state = bushd::test::state_part(sequence, part, 2, 2);
    state.boot_number = 41 + part;
    state.motors[0].name = part == 0 ? name_ : "phi";
    state.motors[1].name = part == 0 ? "chi" : "stop";
    state.motors[0].position_steps = -12;
    state.motors[0].target_steps = 400;
    state.motors[0].velocity_steps_per_s = 2500.5;
    state.motors[0].moving = 1;
    state.motors[1].trust = "uncertain";
    for (const auto& payload : hostile_) (void)transport_->publish_bytes("BUSHD_STATE", payload);
    (void)transport_->publish("BUSHD_STATE", state);
  }
}

void FakeDaemon::on_command(const command_t& command) {
  const int times = ++times_[{command.client_id, command.number}];
  if (times == 1) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(command);
  }
  publish_state();  // as bushd does on any change
  if (!answer_) return;
  for (reply_t reply : answer_(command, times)) {
    reply.client_id = command.client_id;
    reply.number = command.number;
    (void)transport_->publish("BUSHD_REPLY", reply);
  }
}

reply_t accepted() {
  reply_t reply{};
  reply.phase = reply_t::ACCEPTED;
  reply.reason = "accepted";
  return reply;
}

reply_t refused(const std::string& reason) {
  reply_t reply{};
  reply.phase = reply_t::REFUSED;
  reply.result = "refused";
  reply.reason = reason;
  return reply;
}

reply_t result(const command_t& command, const std::string& word) {
  reply_t reply{};
  reply.phase = reply_t::RESULT;
  reply.result = word;
  reply.reason = word + " for a reason";
  if (command.kind == command_t::MOVE_RELATIVE || command.kind == command_t::MOVE_ABSOLUTE) {
    reply.motors = command.motors;
    reply.motor_results.assign(command.motors.size(), word);
    reply.position_steps.assign(command.motors.size(), 7);
    reply.table_of_motor.assign(command.motors.size(), 0);
    reply.tables = {bushd::test::table_ref()};
  }
  reply.motor_count = static_cast<std::int32_t>(reply.motors.size());
  reply.table_count = static_cast<std::int32_t>(reply.tables.size());
  return reply;
}

}  // namespace bushctl::test
