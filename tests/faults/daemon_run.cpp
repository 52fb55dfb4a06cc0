#include "daemon_run.h"

#include <poll.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace bushfaults {
namespace {

namespace daemon = bushd::daemon;
namespace lcm = bushd::lcm;

constexpr int kRequestsPerSlice = 64;

// A queue in memory has nothing to fail for.
void expect(const bushd::Result<void>& done) {
  if (!done) throw std::runtime_error(done.error().text());
}

}  // namespace

DaemonRun::DaemonRun(const bushd::config::Config& config, daemon::Outputs& outputs, Ears ears,
                     std::int64_t run)
    : ears_(std::move(ears)),
      prefix_(config.lcm.prefix + "_"),
      transport_(std::move(*lcm::Transport::open("memq://"))),
      core_(config, outputs, static_cast<std::uint16_t>(run)),
      publishing_(run, config.state_parts(), config.buses.size(),
                  {.now_us = ears_.now_us, .unix_us = ears_.now_us}),
      reception_(core_.counted_stops(),
                 [this](const bushd::api::Asker& asker, const bushd::api::Request& request) {
                   core_.request(ears_.now_us(), ears_.carry_out(asker, request), request);
                 }),
      front_({.transport = *transport_,
              .prefix = config.lcm.prefix,
              .run = run,
              .seed = static_cast<std::uint64_t>(run)},
             reception_, publishing_, ears_.now_us) {
  publishing_.set_refresh([this] { core_.publish_state(ears_.now_us()); });
  publishing_.add(front_);
  for (const std::string_view name : lcm::daemon_channels()) {
    expect(transport_->subscribe(prefix_ + std::string(name), [this, name](auto payload) {
      ears_.said(lcm::decode_daemon_message(name, payload));
    }));
  }
  expect(front_.subscribe());
}

void DaemonRun::give(const lcm::Packet& packet) {
  expect(transport_->publish(prefix_ + packet.channel, packet.payload));
  hear();
}

void DaemonRun::carry_out_some() {
  for (int i = 0; i < kRequestsPerSlice && !reception_.idle(); ++i) reception_.carry_out_next();
}

void DaemonRun::step() {
  publishing_.set_dropped_messages(front_.dropped());
  core_.step(ears_.now_us());
  hear();
}

void DaemonRun::hear() {
  pollfd polled{.fd = transport_->fd(), .events = POLLIN, .revents = 0};
  while (::poll(&polled, 1, 0) > 0) front_.handle();
}

}  // namespace bushfaults
