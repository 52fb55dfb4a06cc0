#include <fmt/format.h>

#include "client/link.h"
#include "lcm/transport.h"

namespace bushd::client {
namespace {

// Two snapshots of the largest installations, each an MCU a message.
constexpr int kQueueCapacity = 1024;

class LcmLink : public Link {
 public:
  LcmLink(std::unique_ptr<lcm::Transport> transport, std::string url, std::string prefix)
      : transport_(std::move(transport)), url_(std::move(url)), prefix_(std::move(prefix)) {}

  Result<void> listen() {
    for (const std::string_view channel : lcm::daemon_channels()) {
      const auto listening = transport_->subscribe(
          prefix_ + "_" + std::string(channel),
          [this, channel](lcm::Payload payload) {
            // Anybody may send anything.
            const auto message = lcm::decode_daemon_message(channel, payload);
            if (message && handler_ != nullptr) (*handler_)(*message);
          },
          kQueueCapacity);
      if (!listening) return listening;
    }
    return {};
  }

  int fd() const override { return transport_->fd(); }
  Result<void> send(const lcm::Packet& packet) override {
    return transport_->publish(prefix_ + "_" + packet.channel, packet.payload);
  }
  Result<void> handle(const Handler& handler) override {
    handler_ = &handler;
    transport_->handle();
    handler_ = nullptr;
    return {};
  }
  bool loses() const override { return true; }
  std::string remedy() const override {
    return fmt::format(
        "no bushd answers on channels {0}_... of {1}. Start `bushd --config FILE`, with url = "
        "\"{1}\" and prefix = \"{0}\" in [lcm] of that file",
        prefix_, url_);
  }

 private:
  std::unique_ptr<lcm::Transport> transport_;
  std::string url_;
  std::string prefix_;
  const Handler* handler_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<Link>> open_lcm(const std::string& url, const std::string& prefix) {
  auto transport = lcm::Transport::open(url);
  if (!transport) return fail(transport.error());
  auto link = std::make_unique<LcmLink>(std::move(*transport), url, prefix);
  if (auto listening = link->listen(); !listening) return fail(listening.error());
  return link;
}

}  // namespace bushd::client
