#include "tools/bushctl/fake_daemon.h"

#include <poll.h>

#include <chrono>
#include <stdexcept>

#include "client/client.h"

namespace bushctl::test {

namespace lcm = bushd::lcm;

FakeDaemon::FakeDaemon() {
  auto transport = lcm::Transport::open(bushd::client::kDefaultUrl);
  if (!transport) throw std::runtime_error(transport.error().text());
  transport_ = std::move(*transport);
}

FakeDaemon::~FakeDaemon() {
  ended_ = true;
  if (thread_.joinable()) thread_.join();
}

void FakeDaemon::start(Answer answer) {
  answer_ = std::move(answer);
  for (const std::string_view channel : lcm::client_channels()) {
    transport_->subscribe("BUSHD_" + std::string(channel),
                          [this, channel](lcm::Payload payload) { on_message(channel, payload); });
  }
  thread_ = std::thread([this] { run(); });
}

std::vector<api::Request> FakeDaemon::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

std::vector<std::string> FakeDaemon::client_ids() const {
  const std::lock_guard lock(mutex_);
  return client_ids_;
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

lcm::Part FakeDaemon::part(std::int32_t index, std::int32_t parts) {
  sequence_ += 1 + lost_;
  return {.utime_us = 1, .run = run_, .sequence = sequence_, .part = index, .parts = parts};
}

void FakeDaemon::publish(const bushd::Result<lcm::Packet>& packet) {
  (void)transport_->publish("BUSHD_" + packet->channel, packet->payload);
}

void FakeDaemon::publish_state() {
  for (std::int32_t mcu = 0; mcu < 2; ++mcu) {
    const api::StateSnapshot state{
        .bus = "hall",
        .mcu = "hall:" + std::to_string(mcu + 1),
        .state = api::McuState::kReady,
        .boot = 41 + mcu,
        .motors = {{.name = mcu == 0 ? name_ : "phi",
                    .position_steps = -12,
                    .target_steps = 400,
                    .velocity_steps_per_s = 2500.5,
                    .activity = api::Activity::kMoving,
                    .moving = true},
                   {.name = mcu == 0 ? "chi" : "stop", .trust = api::Trust::kUncertain}}};
    for (const auto& payload : hostile_) (void)transport_->publish("BUSHD_STATE", payload);
    if (loses_ && mcu == 1) continue;
    publish(lcm::encode(part(mcu, 2), 0, state));
  }
}

void FakeDaemon::publish_rest() {
  for (std::int32_t mcu = 0; mcu < 2; ++mcu) {
    const api::TableRef table{.name = "bushd2-constant", .revision = 3, .hash = "0a1b2c3d"};
    const api::Description description{
        .bus = "hall",
        .mcu = "hall:" + std::to_string(mcu + 1),
        .address = mcu + 1,
        .motors = {{.name = mcu == 0 ? name_ : "phi", .group = "goniometer", .table = table},
                   {.name = mcu == 0 ? "chi" : "stop",
                    .output = 1,
                    .group = "goniometer",
                    .table = table}}};
    publish(lcm::encode(part(mcu, 2), description));
  }
  publish(lcm::encode(part(0, 1), api::HealthSnapshot{.bus = "hall", .port_state = "open"}));
}

void FakeDaemon::on_message(std::string_view channel, lcm::Payload payload) {
  const auto message = lcm::decode_client_message(channel, payload);
  if (!message) return;
  if (const auto* hello = std::get_if<lcm::Hello>(&message->content)) {
    publish(lcm::encode(1, lcm::Welcome{.hello = *hello, .run = run_, .session = 77}));
  } else if (const auto* request = std::get_if<api::Request>(&message->content)) {
    on_request(message->id, *request);
  } else {
    publish_rest();
    publish_state();
    const auto answer =
        lcm::encode(1, message->id,
                    api::Reply(api::Completed{
                        .outcome = api::Outcome::kDone, .reason = "published", .detail = {}}));
    publish(answer.value().front());
  }
}

void FakeDaemon::on_request(const lcm::RequestId& id, const api::Request& request) {
  const int times = ++times_[{id.client_id, id.number}];
  if (times == 1) {
    const std::lock_guard lock(mutex_);
    requests_.push_back(request);
    client_ids_.push_back(id.client_id);
  }
  publish_state();  // as bushd does on any change
  if (!answer_) return;
  for (const api::Reply& reply : answer_(request, times)) {
    const auto parts = lcm::encode(1, id, reply);
    for (const lcm::Packet& part : parts.value()) publish(part);
  }
}

api::Reply result(const api::Request& request, api::Outcome outcome) {
  api::Completed completed{
      .outcome = outcome, .reason = std::string(word(outcome)) + " for a reason", .detail = {}};
  if (const auto* move = std::get_if<api::Move>(&request)) {
    std::vector<api::MotorResult> motors;
    for (const api::MotorAmount& motor : move->motors) {
      motors.push_back({.motor = motor.motor,
                        .outcome = outcome,
                        .position_steps = 7,
                        .user = 7,
                        .dial = 7,
                        .table = {.name = "bushd2-constant", .revision = 3, .hash = "0a1b2c3d"}});
    }
    completed.detail = std::move(motors);
  }
  return completed;
}

}  // namespace bushctl::test
