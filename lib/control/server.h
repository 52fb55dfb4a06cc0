// The daemon's end of the control socket: connections, their packets, and bounds for both. What the
// packets mean is for others.
//
// Rights are those of the socket's file. A connection that sends what is no packet, or does not
// read what it is sent, is closed. One thread; nothing blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/session.h"
#include "base/result.h"
#include "control/listener.h"
#include "control/packet.h"
#include "control/places.h"

struct msghdr;

namespace bushd::control {

struct Limits {
  Places::Limits places{};
  // Packets that clients have not read yet: the most of one, and of all. Who has most unread is
  // closed when it is too much of all.
  std::size_t unread_bytes = 1024 * 1024;
  std::size_t unread_bytes_in_all = 32 * 1024 * 1024;
  // Packets that were none, before the connection is closed.
  unsigned bad_packets = 16;
  // Read in one call of handle(), a little more for each packet, and what is sent meanwhile counts,
  // so that it takes less than a millisecond however many connections talk. At least one packet is,
  // however large the answer; connections take turns.
  std::size_t bytes_at_once = 64 * 1024;
};

class Server {
 public:
  using Connection = std::uint64_t;  // never used again

  // When a packet was sent, by the system's clock, in nanoseconds: exactly, or between these two.
  struct Sent {
    std::int64_t earliest_ns;
    std::int64_t latest_ns;
  };

  // Called from within handle(); they may send and close.
  struct Handlers {
    // `why_stops_only`: who has the places for all uses; "": this is one of them.
    std::function<void(Connection, const api::Credentials&, const std::string& why_stops_only)>
        opened;
    std::function<void(Connection, View, const Sent&)> packet;
    // Packets on such a channel are read before those of all other connections.
    std::function<bool(std::string_view channel)> is_urgent{};
    std::function<void(Connection)> closed;
    // For the log: whom it does not serve as others, and why.
    std::function<void(const std::string&)> noted{};
  };

  // Makes the socket (Listener::open).
  static Result<std::unique_ptr<Server>> open(const std::string& path, const std::string& group,
                                              Limits limits = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void set_handlers(Handlers handlers) { handlers_ = std::move(handlers); }

  // Readable (level-triggered) while there is something to handle.
  int fd() const { return epoll_; }
  void handle();

  // Packets arrive whole and in order, or the connection is closed. Of one that has gone it does
  // nothing. Cheap: a packet made once may be sent to many.
  void send(Connection connection, std::shared_ptr<const std::vector<std::uint8_t>> packet);
  // The largest answer that one request gets, in bytes: a client may leave two of them unread
  // beside what the limits say, and all clients sixteen. Takes effect with the next send().
  void set_largest_answer(std::size_t bytes) { largest_answer_ = bytes; }
  // Counts a packet that meant nothing.
  void reject(Connection connection);

  // Whether the socket's file is there; if not, connections go on, and nobody else can connect
  // until it is restored.
  bool in_place() const { return listener_.in_place(); }
  Result<void> restore();

  const std::string& path() const { return listener_.path(); }
  std::size_t connections() const { return peers_.size(); }
  // Packets that were none, and connections that were not taken or closed for what they did.
  std::uint64_t dropped() const { return dropped_; }
  std::size_t unread_bytes() const { return unread_bytes_; }

 private:
  static constexpr std::size_t kAnswersUnread = 2;
  static constexpr std::size_t kAnswersUnreadInAll = 16;

  struct Peer {
    int fd;
    api::Credentials who;
    std::deque<std::shared_ptr<const std::vector<std::uint8_t>>> unread{};
    std::size_t unread_bytes = 0;
    unsigned bad = 0;
    bool doomed = false;
    // Sent before the connection was accepted: so many bytes, whose times the kernel does not tell,
    // and not before this.
    std::size_t unstamped_bytes = 0;
    std::int64_t connected_after_ns = 0;
  };

  Server(Listener listener, int epoll, Limits limits);
  Result<void> watch_listener();
  void accept_all();
  void accept_one(int fd);
  // A place for who comes next: one that is kept for stops may have to be given up. Not while all
  // of those wait to be heard.
  bool make_room();
  void handle_peer(Connection connection, std::uint32_t events);
  // The packet that it has sent longest ago is urgent.
  bool is_urgent(const Peer& peer) const;
  static Sent sent_at(Peer& peer, std::size_t bytes, const msghdr& message);
  // One packet. Returns whether the connection may go on.
  bool read(Connection connection, Peer& peer);
  bool flush(Peer& peer);
  void forget_unread(Peer& peer);
  void close_deaf(Connection connection, Peer& peer);
  // Less is unread of all: sends to who has most unread, or closes it.
  void relieve();
  std::size_t most_unread() const {
    return limits_.unread_bytes + kAnswersUnread * largest_answer_;
  }
  std::size_t most_unread_in_all() const {
    return limits_.unread_bytes_in_all + kAnswersUnreadInAll * largest_answer_;
  }
  void note(const std::string& text) const;
  void doom(Connection connection, Peer& peer);
  void close(Connection connection);
  void watch(Connection connection, const Peer& peer, int operation) const;

  Listener listener_;
  int epoll_;
  int spare_;  // given up for a moment to turn a connection away when there are no descriptors left
  Limits limits_;
  Handlers handlers_;
  Connection last_ = 0;  // 0 is the listener
  Places places_;
  std::map<Connection, Peer> peers_;
  std::vector<Connection> doomed_;
  std::size_t unread_bytes_ = 0;
  std::size_t largest_answer_ = 0;
  std::uint64_t dropped_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::size_t bytes_left_ = 0;   // of those that this call of handle() reads and sends
  Connection turn_ = 0;          // who was served last, but for what is urgent
  std::int64_t nobody_came_ns_;  // until then all who wanted to connect had been accepted
};

}  // namespace bushd::control
