// A client, and a daemon that loses messages, falls silent or restarts.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/fake_link.h"

namespace bushd::client {

inline constexpr std::int64_t kSession = 77;
// Patient where patience must not matter, so that a busy machine fails no test.
inline constexpr std::chrono::milliseconds kPatient = std::chrono::minutes(5);

class ClientTest : public testing::Test {
 protected:
  void SetUp() override { open(true); }
  ~ClientTest() override { close(interrupt_); }

  void open(bool loses, std::chrono::milliseconds patience = kPatient) {
    using std::chrono::milliseconds;
    requests_.clear();
    auto link = std::make_unique<test::FakeLink>(loses);
    link_ = link.get();
    link_->on_send = [this](const lcm::ClientMessage& message) { on_send(message); };
    client_ = std::make_unique<Client>(std::move(link),
                                       ClientOptions{.program = "test",
                                                     .interrupt_fd = interrupt_,
                                                     .resend_every = milliseconds(3),
                                                     .answer_within = patience,
                                                     .ask_again_every = milliseconds(10),
                                                     .silence_limit = patience,
                                                     .others_answer_within = milliseconds(1)});
  }

  void on_send(const lcm::ClientMessage& message) {
    if (const auto* hello = std::get_if<lcm::Hello>(&message.content)) {
      if (++hellos_ > lost_hellos_) {
        link_->say(lcm::Welcome{.hello = *hello, .run = run_, .session = session_});
      }
    } else if (std::holds_alternative<api::Request>(message.content)) {
      requests_.push_back(message);
      if (daemon_) daemon_();
    } else if (std::holds_alternative<lcm::GetStatus>(message.content)) {
      ++status_asked_;
      if (on_status_) on_status_();
    }
  }

  void reply(const api::Reply& reply) {
    link_->say(lcm::ReplyMessage{.id = requests_.back().id, .reply = reply});
  }
  static api::Reply result(api::Outcome outcome) {
    return api::Completed{.outcome = outcome, .reason = "because", .detail = {}};
  }
  void state(std::int64_t sequence, std::int32_t part = 0, std::int32_t parts = 1) {
    lcm::StateMessage message;
    message.part = {.run = run_, .sequence = sequence, .part = part, .parts = parts};
    message.snapshot.mcu = "hall:" + std::to_string(part + 1);
    message.snapshot.tick = sequence;
    link_->say(message);
  }
  void description(std::int64_t sequence, std::int32_t part = 0, std::int32_t parts = 1) {
    link_->say(lcm::DescriptionMessage{
        .part = {.run = run_, .sequence = sequence, .part = part, .parts = parts}, .snapshot = {}});
  }
  void health(std::int64_t sequence) {
    link_->say(
        lcm::HealthMessage{.part = {.sequence = sequence, .part = 0, .parts = 1}, .snapshot = {}});
  }
  // A message that makes the next one: something goes on as long as the client handles messages.
  void keep_publishing_states() {
    link_->on_handled = [this](const lcm::DaemonMessage& heard) {
      if (const auto* message = std::get_if<lcm::StateMessage>(&heard)) {
        state(message->part.sequence + 1);
      }
    };
    state(1);
  }
  Result<api::Reply> run(const api::Request& request, Client::Until until) {
    return client_->run(
        request, until,
        {.on_reply = [this](const api::Reply& heard) { heard_.push_back(heard.index()); },
         .on_state = on_state_,
         .on_interrupt = on_interrupt_});
  }
  Result<api::Reply> move(Client::Until until = Client::Until::kResult) {
    return run(api::Move{.motors = {{"theta", -400}}}, until);
  }
  // The word of its outcome, "accepted", "refused: WHY", or why there is no answer.
  static std::string end_of(const Result<api::Reply>& reply) {
    if (!reply) return reply.error().text();
    const auto* completed = std::get_if<api::Completed>(&*reply);
    if (completed != nullptr) return std::string(word(completed->outcome));
    return api::is_final(*reply) ? "refused: " + api::reason_of(*reply) : "accepted";
  }

  int interrupt_ = eventfd(0, EFD_CLOEXEC);
  test::FakeLink* link_ = nullptr;
  std::unique_ptr<Client> client_;
  std::function<void()> daemon_;
  std::function<void()> on_status_;
  std::function<void(const Status&)> on_state_;
  std::function<std::optional<api::Request>()> on_interrupt_;
  std::vector<lcm::ClientMessage> requests_;
  std::vector<std::size_t> heard_;
  std::int64_t run_ = 5;
  std::int64_t session_ = kSession;
  int hellos_ = 0;
  int lost_hellos_ = 0;
  int status_asked_ = 0;
};

}  // namespace bushd::client
