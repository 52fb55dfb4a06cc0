#include "lcm/client.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <random>
#include <utility>

namespace bushd::lcm {
namespace {

constexpr std::size_t kMaxClientId = 64;  // command_t.lcm

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0) return "unknown";
  return name.data();
}

// Unique among running clients: process numbers repeat, and containers may share a host's name.
std::string make_id(const std::string& program) {
  std::random_device random;
  const std::string tail = fmt::format("-{}-{:08x}", getpid(), random());
  std::string head = program + "-" + host_name();
  head.resize(std::min(head.size(), kMaxClientId - tail.size()));
  std::replace_if(
      head.begin(), head.end(), [](unsigned char c) { return c >= 0x80 || std::isgraph(c) == 0; },
      '_');
  return head + tail;
}

std::int64_t unix_time_us() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count();
}

bool readable(int fd) {
  pollfd polled{.fd = fd, .events = POLLIN, .revents = 0};
  return fd >= 0 && poll(&polled, 1, 0) > 0;
}

}  // namespace

Result<std::unique_ptr<Client>> Client::open(ClientOptions options) {
  auto transport = Transport::open(options.url);
  if (!transport) return fail(transport.error());
  std::unique_ptr<Client> client(new Client(std::move(*transport), std::move(options)));
  if (auto listening = client->listen(); !listening) return fail(listening.error());
  return client;
}

Client::Client(std::unique_ptr<Transport> transport, ClientOptions options)
    : transport_(std::move(transport)),
      options_(std::move(options)),
      id_(make_id(options_.program)) {}

Result<void> Client::listen() {
  auto replies = transport_->subscribe<reply_t>(options_.prefix + "_REPLY",
                                                [this](const reply_t& reply) { on_reply(reply); });
  if (!replies) return replies;
  auto health =
      transport_->subscribe<health_t>(options_.prefix + "_HEALTH", [this](const health_t& part) {
        if (auto complete = health_collector_.add(part)) newest_health_ = std::move(complete);
      });
  if (!health) return health;
  auto tables = transport_->subscribe<table_reply_t>(
      options_.prefix + "_TABLE_REPLY", [this](const table_reply_t& reply) {
        if (reply.client_id == id_ && reply.number == number_) table_reply_ = reply;
      });
  if (!tables) return tables;
  return transport_->subscribe<state_t>(options_.prefix + "_STATE",
                                        [this](const state_t& state) { on_state(state); });
}

void Client::on_reply(const reply_t& reply) {
  if (reply.client_id != id_ || reply.number != number_) return;
  std::optional<reply_t>& place = reply.phase == reply_t::ACCEPTED ? accepted_ : final_;
  if (!place) place = reply;
}

void Client::on_state(const state_t& state) {
  // The daemon counts its snapshots up from its start.
  if (sequence_ && state.sequence < *sequence_) restarted_ = true;
  sequence_ = state.sequence;
  state_heard_ = Clock::now();
  if (auto complete = collector_.add(state)) newest_ = std::move(complete);
}

Result<void> Client::wait(Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  std::array<pollfd, 2> polled{{{.fd = transport_->fd(), .events = POLLIN, .revents = 0},
                                {.fd = options_.interrupt_fd, .events = POLLIN, .revents = 0}}};
  poll(polled.data(), polled.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
  if (readable(options_.interrupt_fd)) {
    interrupted_ = true;
    return fail("interrupted");
  }
  transport_->handle();
  return {};
}

void Client::drain() {
  // Each of the four subscriptions may hold a full queue.
  for (int i = 0; i < 4 && readable(transport_->fd()); ++i) transport_->handle();
}

Error Client::no_daemon() const {
  return {
      .message = fmt::format(
          "no bushd answers on channels {0}_... of {1}. Start `bushd --config FILE`, with url = "
          "\"{1}\" and prefix = \"{0}\" in [lcm] of that file",
          options_.prefix, options_.url)};
}

Result<reply_t> Client::run(command_t command, Until until,
                            const std::function<void(const reply_t&)>& on_reply) {
  command.client_id = id_;
  command.number = ++number_;
  command.utime_us = unix_time_us();
  command.motor_count = static_cast<std::int32_t>(command.motors.size());
  const std::string channel = options_.prefix + "_COMMAND";
  // What happened to the daemon before this command is no concern of it.
  drain();
  sequence_.reset();
  restarted_ = false;
  accepted_.reset();
  final_.reset();
  bool reported = false;

  const Clock::time_point give_up = Clock::now() + options_.answer_within;
  Clock::time_point next_send = Clock::now();
  Clock::time_point answered{};
  for (;;) {
    const bool was_answered = accepted_ || final_;
    if (!was_answered && Clock::now() >= next_send) {
      if (auto sent = transport_->publish(channel, command); !sent) return fail(sent.error());
      next_send = Clock::now() + options_.resend_every;
    }
    const Clock::time_point silent = std::max(state_heard_, answered) + options_.silence_limit;
    const Clock::time_point heard_before = state_heard_;
    auto waited = wait(was_answered ? silent : std::min(next_send, give_up));
    if (!waited) return fail(waited.error());

    if (accepted_ && !std::exchange(reported, true) && on_reply) on_reply(*accepted_);
    if (final_) {
      if (on_reply) on_reply(*final_);
      return *final_;
    }
    if (accepted_ && until == Until::kAnswered) return *accepted_;
    // A daemon that has restarted does not know the command and would run it once more.
    if (restarted_) {
      return fail(
          "the daemon has restarted meanwhile (or two of them use this prefix), so the result is "
          "lost; "
          "'bushctl status' shows where the motors are");
    }
    const Clock::time_point now = Clock::now();
    if (!accepted_) {
      if (now >= give_up) return fail(no_daemon());
      continue;
    }
    if (!was_answered) {
      answered = now;
      next_send = now + options_.ask_again_every;
      continue;
    }
    if (now >= silent && state_heard_ == heard_before) {
      return fail(
          "the daemon accepted the command and has fallen silent since; what became of it is "
          "unknown");
    }
    // The result may have been lost. Asked for only right after the daemon has shown itself to be
    // still the same.
    if (now >= next_send && state_heard_ != heard_before) {
      if (auto sent = transport_->publish(channel, command); !sent) return fail(sent.error());
      next_send = now + options_.ask_again_every;
    }
  }
}

Result<table_reply_t> Client::ask(table_request_t request) {
  request.client_id = id_;
  request.number = ++number_;
  request.utime_us = unix_time_us();
  request.content_count = static_cast<std::int32_t>(request.content.size());
  table_reply_.reset();
  const Clock::time_point give_up = Clock::now() + options_.answer_within;
  Clock::time_point next_send = Clock::now();
  while (!table_reply_) {
    if (Clock::now() >= give_up) return fail(no_daemon());
    if (Clock::now() >= next_send) {
      const auto sent = transport_->publish(options_.prefix + "_TABLE_REQUEST", request);
      if (!sent) return fail(sent.error());
      next_send = Clock::now() + options_.resend_every;
    }
    if (auto waited = wait(std::min(next_send, give_up)); !waited) return fail(waited.error());
  }
  return std::move(*table_reply_);
}

template <class Whole>
Result<Whole> Client::await(std::optional<Whole>& newest, std::chrono::milliseconds timeout) {
  drain();
  newest.reset();
  const Clock::time_point deadline = Clock::now() + timeout;
  while (!newest) {
    if (auto waited = wait(deadline); !waited) return fail(waited.error());
    if (!newest && Clock::now() >= deadline) return fail(no_daemon());
  }
  return std::move(*newest);
}

Result<Snapshot> Client::snapshot(std::chrono::milliseconds timeout) {
  return await(newest_, timeout);
}

Result<Health> Client::health(std::chrono::milliseconds timeout) {
  return await(newest_health_, timeout);
}

}  // namespace bushd::lcm
