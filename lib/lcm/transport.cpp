#include "lcm/transport.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <set>

#include "lcm/datagram_filter.h"
#include "lcm/loopback_only.h"
#include "lcm/receive_buffer.h"

namespace bushd::lcm {
namespace {

// The longest name of a channel in LCM's wire format.
constexpr std::size_t kMaxChannelName = LCM_MAX_CHANNEL_NAME_LENGTH;

// "" for URLs that are none of multicast.
std::string multicast_address(const std::string& url) {
  const auto multicast = multicast_url(url);
  return multicast ? multicast->address : "";
}

// Packets to this address have a way, as LCM finds by the same two calls. Where they have none it
// writes a page on stderr.
bool has_route(const std::string& address) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(1);  // any
  if (inet_aton(address.c_str(), &group.sin_addr) == 0) return false;
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;  // its business
  const ip_mreq membership{.imr_multiaddr = group.sin_addr, .imr_interface = {INADDR_ANY}};
  const bool has =
      ::connect(fd, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0 &&
      ::setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
  ::close(fd);
  return has;
}

// What is not is told here, in one line: LCM's library says it in its own words, on stderr.
bool is_usable(const std::string& url) {
  const std::string address = multicast_address(url);
  return address.empty() ? url.find("://") != std::string::npos : has_route(address);
}

Error cannot_open(const std::string& url) {
  const std::string address = multicast_address(url);
  if (address.empty()) {
    return {.message = fmt::format("LCM cannot use the URL \"{}\"; one that works is "
                                   "\"udpm://239.255.76.67:7667?ttl=0\"",
                                   url)};
  }
  return {.message = fmt::format(
              "LCM cannot use the URL \"{}\": the address is wrong or there is no route "
              "to it. For this machine only: ip route replace {}/32 dev lo (as root)",
              url, address)};
}

Error cannot_receive(const std::string& url) {
  return {
      .message = fmt::format(
          "LCM at \"{}\" does not hear its own packets. Check that multicast goes to a device that "
          "carries it (ip route get {}) and that no firewall drops UDP to it",
          url, multicast_address(url))};
}

// LCM takes the name of a subscribed channel for a regular expression.
std::string literal(const std::string& channel) {
  std::string out;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') out += '\\';
    out += c;
  }
  return out;
}

Result<void> check_channel(const std::string& channel) {
  if (!channel.empty() && channel.size() <= kMaxChannelName) return {};
  return fail(
      fmt::format("channel name \"{}\" has {} characters; LCM allows 1 to {}: shorten the prefix",
                  channel, channel.size(), kMaxChannelName));
}

}  // namespace

Result<std::unique_ptr<Transport>> Transport::open(const std::string& url,
                                                   const std::vector<std::string>& channels,
                                                   const std::vector<std::string>& unheard) {
  if (!is_usable(url)) return fail(cannot_open(url));
  const std::set<int> others = udp_sockets();
  lcm_t* lcm = lcm_create(url.c_str());
  if (lcm == nullptr) return fail(cannot_open(url));
  // Asked now: without a descriptor LCM's later calls abort the process.
  const int fd = lcm_get_fileno(lcm);
  if (fd < 0) {
    lcm_destroy(lcm);
    return fail(cannot_receive(url));
  }
  std::unique_ptr<Transport> transport(new Transport(lcm, fd));
  for (const int udp_socket : udp_sockets()) {
    if (others.contains(udp_socket)) continue;
    // Who gives a size gets that one.
    if (url.find("recv_buf_size=") == std::string::npos) enlarge_receive_buffer(udp_socket);
    const auto multicast = multicast_url(url);
    if (multicast && multicast->ttl == 0) {
      if (auto kept = keep_on_loopback(udp_socket, *multicast); !kept) return fail(kept.error());
    }
    if (auto filtered = accept_whole_messages_only(udp_socket, channels, unheard); !filtered)
      return fail(filtered.error());
  }
  return transport;
}

Transport::~Transport() {
  lcm_destroy(lcm_);
}

void Transport::handle(std::size_t max_bytes) {
  handled_bytes_ = 0;
  for (int i = 0; i < kQueueCapacity && handled_bytes_ < max_bytes; ++i) {
    if (lcm_handle_timeout(lcm_, 0) <= 0) return;
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }
}

void Transport::on_message(const lcm_recv_buf_t* buffer, const char*, void* subscription) {
  constexpr std::size_t kPerMessage = 256;
  auto& self = *static_cast<Subscription*>(subscription);
  self.transport->handled_bytes_ += buffer->data_size + kPerMessage;
  self.transport->received_utime_us_ = buffer->recv_utime;
  // C code calls this. An exception that passed through it would leave LCM believing that a handler
  // still runs, and the next lcm_handle() would abort.
  try {
    self.handler({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  } catch (...) {
    self.transport->thrown_ = std::current_exception();
  }
}

Result<void> Transport::subscribe(const std::string& channel, BytesHandler handler,
                                  int queue_capacity) {
  if (auto checked = check_channel(channel); !checked) return checked;
  auto subscription = std::make_unique<Subscription>(Subscription{this, std::move(handler)});
  lcm_subscription_t* added =
      lcm_subscribe(lcm_, literal(channel).c_str(), &Transport::on_message, subscription.get());
  if (added == nullptr)
    return fail(fmt::format("LCM refuses to subscribe to channel \"{}\"", channel));
  lcm_subscription_set_queue_capacity(added, queue_capacity);
  subscriptions_.push_back(std::move(subscription));
  return {};
}

Result<void> Transport::publish(const std::string& channel, std::span<const std::uint8_t> bytes) {
  if (auto checked = check_channel(channel); !checked) return checked;
  if (lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size())) != 0) {
    return fail(fmt::format("LCM cannot send on channel \"{}\": is the network up?", channel));
  }
  return {};
}

}  // namespace bushd::lcm
