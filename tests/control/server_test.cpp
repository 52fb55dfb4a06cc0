// The daemon's end of the control socket, with clients of all kinds in the same thread: everything
// that was sent has arrived once handle() has nothing more to do.
#include "control/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "tables/temp_directory.h"

namespace bushd::control::server_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;
using testing::HasSubstr;

Bytes bytes(const std::string& channel, std::size_t payload = 0) {
  return packet_of({.channel = channel, .payload = Bytes(payload)});
}

class Peer {
 public:
  explicit Peer(const std::string& path)
      : fd_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.size());
    connected_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Peer() { leave(); }
  Peer(Peer&& other) noexcept : fd_(std::exchange(other.fd_, -1)), connected_(other.connected_) {}
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  bool connected() const { return connected_; }
  bool send(const Bytes& packet) const {
    return ::send(fd_, packet.data(), packet.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
           static_cast<ssize_t>(packet.size());
  }
  // Empty: nothing waits.
  Bytes read() const {
    Bytes packet(kMaxPacketBytes);
    const ssize_t n = ::recv(fd_, packet.data(), packet.size(), MSG_DONTWAIT);
    packet.resize(n < 0 ? 0 : static_cast<std::size_t>(n));
    return packet;
  }
  bool hung_up() const {
    pollfd polled{.fd = fd_, .events = POLLIN, .revents = 0};
    return ::poll(&polled, 1, 0) > 0 && (polled.revents & POLLHUP) != 0;
  }
  void leave() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }

 private:
  int fd_;
  bool connected_ = false;
};

class ServerTest : public testing::Test {
 protected:
  void open(Limits limits = {}) {
    auto opened = Server::open(path_, "", limits);
    ASSERT_TRUE(opened) << opened.error().text();
    server_ = std::move(*opened);
    server_->set_handlers({.opened =
                               [this](Server::Connection connection, const api::Credentials& who,
                                      const std::string& why_stops_only) {
                                 last_ = connection;
                                 connections_.push_back(connection);
                                 who_ = who;
                                 why_stops_only_ = why_stops_only;
                               },
                           .packet =
                               [this](Server::Connection, View view, const Server::Sent& sent) {
                                 sent_.push_back(sent);
                                 heard_.emplace_back(view.channel);
                                 if (on_packet_) on_packet_();
                               },
                           .is_urgent = [](std::string_view channel) { return channel == "STOP"; },
                           .closed = [this](Server::Connection) { ++closed_; },
                           .noted = [this](const std::string& text) { noted_.push_back(text); }});
  }
  void settle() {
    pollfd polled{.fd = server_->fd(), .events = POLLIN, .revents = 0};
    for (int i = 0; i < 100'000 && ::poll(&polled, 1, 0) > 0; ++i) server_->handle();
  }
  void send(Server::Connection connection, const Bytes& packet) {
    server_->send(connection, std::make_shared<const Bytes>(packet));
  }

  // Taken by the server.
  Peer connect() {
    Peer peer(path_);
    settle();
    return peer;
  }
  // A hundred at once, before the server looks.
  std::vector<Peer> connect_many(int count) {
    std::vector<Peer> peers;
    for (int i = 1; i <= count; ++i) {
      peers.emplace_back(path_);
      if (i % 100 == 0) settle();
    }
    settle();
    return peers;
  }
  static std::string refused(const std::string& path, const std::string& group = {}) {
    const auto opened = Server::open(path, group);
    return opened ? "opened" : opened.error().text();
  }

  test::TempDirectory directory_;
  std::string path_ = (directory_.path() / "run" / "control").string();
  std::unique_ptr<Server> server_;
  std::vector<std::string> heard_;
  std::vector<Server::Sent> sent_;
  std::function<void()> on_packet_;
  Server::Connection last_ = 0;
  std::vector<Server::Connection> connections_;
  api::Credentials who_;
  std::string why_stops_only_;
  std::vector<std::string> noted_;
  int closed_ = 0;
};

TEST_F(ServerTest, PacketsArriveInOrderAndAreAnswered) {
  open();
  const Peer peer(path_);
  ASSERT_TRUE(peer.connected());
  for (const char* channel : {"A", "B", "C"}) EXPECT_TRUE(peer.send(bytes(channel)));
  settle();
  EXPECT_THAT(heard_, ElementsAre("A", "B", "C"));
  send(last_, bytes("REPLY", 5));
  EXPECT_EQ(peer.read(), bytes("REPLY", 5));
}

TEST_F(ServerTest, UrgentPacketsComeBeforeThoseOfOthers) {
  open();
  const std::vector<Peer> peers = connect_many(100);
  for (const Peer& peer : peers) EXPECT_TRUE(peer.send(bytes("MOVE", 30'000)));
  const Peer stops(path_);
  EXPECT_TRUE(stops.send(bytes("STOP")));
  server_->handle();  // takes the connection
  heard_.clear();
  server_->handle();
  EXPECT_EQ(heard_.at(0), "STOP");
  EXPECT_LT(heard_.size(), 10u) << "the others have their turn later";
  settle();
}

TEST_F(ServerTest, ReadsALittleAtOnceAndConnectionsTakeTurns) {
  open({.bytes_at_once = 64 * 1024});
  const std::vector<Peer> peers = connect_many(9);
  for (int i = 0; i < 9; ++i) {
    for (int n = 0; n < 2; ++n) {
      EXPECT_TRUE(peers[static_cast<std::size_t>(i)].send(bytes("P" + std::to_string(i), 30'000)));
    }
  }
  std::vector<std::string> heard;
  for (int call = 0; call < 3; ++call) {
    server_->handle();
    EXPECT_EQ(heard_.size(), 3u);
    heard.insert(heard.end(), heard_.begin(), heard_.end());
    heard_.clear();
  }
  std::ranges::sort(heard);
  EXPECT_THAT(heard, ElementsAre("P0", "P1", "P2", "P3", "P4", "P5", "P6", "P7", "P8"));
}

TEST_F(ServerTest, TellsWhoIsThere) {
  open();
  const Peer peer = connect();
  EXPECT_EQ(who_.pid, ::getpid());
  EXPECT_EQ(who_.uid, ::getuid());
}

TEST_F(ServerTest, TheFileHasItsRights) {
  open();
  struct stat status{};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777u, 0660u);
  server_.reset();
  EXPECT_NE(::stat(path_.c_str(), &status), 0);
}

TEST_F(ServerTest, OnlyOneDaemonHasIt) {
  open();
  EXPECT_THAT(refused(path_), HasSubstr("another daemon has this control socket"));
  EXPECT_TRUE(Peer(path_).connected());
}

TEST_F(ServerTest, WhatADeadDaemonHasLeftIsReplaced) {
  open();
  const Peer before(path_);
  server_.reset();
  EXPECT_TRUE(before.hung_up());
  std::ofstream(path_) << "left behind";
  open();
  EXPECT_TRUE(Peer(path_).connected());
}

TEST_F(ServerTest, AnUnknownGroupIsRefused) {
  EXPECT_THAT(refused(path_, "no-such-group-of-users"), HasSubstr("no-such-group-of-users"));
}

TEST_F(ServerTest, WhatIsNoPacketIsCountedAndTooManyEndTheConnection) {
  open({.bad_packets = 3});
  const Peer peer(path_);
  EXPECT_TRUE(peer.send(Bytes(5, 'x')));
  EXPECT_TRUE(peer.send(bytes("GOOD")));
  settle();
  EXPECT_THAT(heard_, ElementsAre("GOOD"));
  EXPECT_EQ(server_->dropped(), 1u);
  for (int i = 0; i < 5; ++i) peer.send(Bytes(5, 'x'));
  settle();
  EXPECT_EQ(server_->connections(), 0u);
  EXPECT_TRUE(peer.hung_up());
  EXPECT_EQ(closed_, 1);
}

TEST_F(ServerTest, APacketThatIsTooLongIsDroppedWhole) {
  open();
  const Peer peer(path_);
  EXPECT_TRUE(peer.send(bytes("LONGEST", lcm::kMaxMessageBytes)));
  EXPECT_TRUE(peer.send(bytes("TOO_LONG", kMaxPacketBytes)));
  EXPECT_TRUE(peer.send(bytes("NEXT")));
  settle();
  EXPECT_THAT(heard_, ElementsAre("LONGEST", "NEXT"));
  EXPECT_EQ(server_->dropped(), 1u);
}

TEST_F(ServerTest, WhoNeverReadsIsDropped) {
  open({.unread_bytes = 200'000});
  const Peer deaf = connect();
  const Server::Connection connection = last_;
  const Peer other = connect();
  for (int i = 0; i < 1000; ++i) {
    send(connection, bytes("STATE", 4000));
    EXPECT_LE(server_->unread_bytes(), 200'000u);
  }
  settle();
  EXPECT_EQ(server_->connections(), 1u);
  EXPECT_EQ(server_->unread_bytes(), 0u);
  send(last_, bytes("STATE"));
  EXPECT_EQ(other.read(), bytes("STATE"));
}

TEST_F(ServerTest, TwoLargestAnswersMayBeUnreadBesideTheLimit) {
  open({.unread_bytes = 100'000});
  const Peer slow = connect();
  server_->set_largest_answer(200'000);
  for (int i = 0; i < 120; ++i) send(last_, bytes("STATE", 4000));
  settle();
  EXPECT_EQ(server_->connections(), 1u);
  EXPECT_GT(server_->unread_bytes(), 100'000u);
  server_->set_largest_answer(0);
  send(last_, bytes("STATE", 4000));
  settle();
  EXPECT_EQ(server_->connections(), 0u);
}

TEST_F(ServerTest, WhoReadsLateGetsEverything) {
  open();
  const Peer slow = connect();
  for (int i = 0; i < 200; ++i) send(last_, bytes("STATE" + std::to_string(i), 4000));
  EXPECT_GT(server_->unread_bytes(), 0u);
  int next = 0;
  for (int i = 0; i < 1000 && next < 200; ++i) {
    for (Bytes packet = slow.read(); !packet.empty(); packet = slow.read()) {
      EXPECT_EQ(packet, bytes("STATE" + std::to_string(next++), 4000));
    }
    settle();
  }
  EXPECT_EQ(next, 200);
  EXPECT_EQ(server_->unread_bytes(), 0u);
}

TEST_F(ServerTest, MemoryOfAllIsBounded) {
  open({.unread_bytes_in_all = 500'000});
  const std::vector<Peer> deaf = connect_many(20);
  for (int i = 0; i < 100; ++i) {
    for (const Server::Connection connection : connections_) {
      send(connection, bytes("STATE", 4000));
      ASSERT_LE(server_->unread_bytes(), 500'000u);
    }
  }
}

// Who reads what is sent loses nothing, however many others do not.
TEST_F(ServerTest, OfAllWhoDoNotReadTheOneWithMostUnreadGoes) {
  open({.unread_bytes_in_all = 500'000});
  const std::vector<Peer> deaf = connect_many(20);
  const Peer good = connect();
  std::ranges::rotate(connections_, connections_.end() - 1);  // the good one is sent to first
  for (int i = 0; i < 500; ++i) {
    for (const Server::Connection connection : connections_) send(connection, bytes("STATE", 4000));
    ASSERT_LE(server_->unread_bytes(), 500'000u);
    ASSERT_EQ(good.read(), bytes("STATE", 4000)) << i;
  }
  EXPECT_FALSE(good.hung_up());
  EXPECT_TRUE(std::ranges::any_of(deaf, &Peer::hung_up));
  ASSERT_FALSE(noted_.empty());
  EXPECT_EQ(noted_.front().find("control socket: process " + std::to_string(::getpid())), 0u);
}

// The room in the kernel counts, not what the server has noticed of it.
TEST_F(ServerTest, WhoHasReadMeanwhileIsSentToBeforeItCountsAsDeaf) {
  open({.unread_bytes = 100'000});
  const Peer slow = connect();
  while (server_->unread_bytes() + 5000 < 100'000u) send(last_, bytes("STATE", 4000));
  while (!slow.read().empty()) {
  }
  for (int i = 0; i < 20; ++i) send(last_, bytes("STATE", 4000));
  EXPECT_FALSE(slow.hung_up());
}

TEST_F(ServerTest, OneProcessLeavesPlacesForStops) {
  open({.places = {.of_process = 5, .for_stops = 3}});
  std::vector<Peer> peers;
  for (int i = 0; i < 20; ++i) {
    peers.push_back(connect());
    EXPECT_EQ(why_stops_only_.empty(), i < 5) << i;
    EXPECT_LE(server_->connections(), 8u);
  }
  EXPECT_THAT(why_stops_only_, HasSubstr("process " + std::to_string(::getpid()) + " of user " +
                                         std::to_string(::getuid()) + " has 5 connections"));
  for (std::size_t i = 0; i < peers.size(); ++i) EXPECT_EQ(peers[i].hung_up(), i >= 5 && i < 17);
  EXPECT_EQ(noted_.size(), 1u) << "once, not for each";
  peers.front().leave();
  settle();
  const Peer again = connect();
  EXPECT_EQ(why_stops_only_, "") << "a place is free again";
}

// However many come at once, and whoever else has the places.
TEST_F(ServerTest, WhoHasSentSomethingIsReadBeforeItsPlaceIsAnothers) {
  open({.places = {.of_process = 2, .for_stops = 2}});
  std::vector<Peer> peers;
  for (int i = 0; i < 50; ++i) {
    peers.emplace_back(path_);
    EXPECT_TRUE(peers.back().send(bytes("STOP")));
  }
  settle();
  EXPECT_EQ(heard_.size(), 50u);
}

TEST_F(ServerTest, FoldersOfThePathAreMade) {
  path_ = (directory_.path() / "a" / "b" / "c" / "control").string();
  open();
  EXPECT_TRUE(Peer(path_).connected());
}

TEST_F(ServerTest, AFolderThatCannotBeMadeIsNamed) {
  std::ofstream(directory_.path() / "file") << "no folder";
  EXPECT_THAT(
      refused((directory_.path() / "file" / "b" / "control").string()),
      HasSubstr("/file: the folder of the control socket cannot be made: a file has its name"));
}

TEST_F(ServerTest, ASocketThatWasDeletedComesBack) {
  open();
  const Peer before = connect();
  const Server::Connection connection = last_;
  for (const bool with_folder : {false, true}) {
    EXPECT_TRUE(server_->in_place());
    std::filesystem::remove_all(with_folder ? std::filesystem::path(path_).parent_path()
                                            : std::filesystem::path(path_));
    EXPECT_FALSE(server_->in_place());
    const auto restored = server_->restore();
    ASSERT_TRUE(restored) << restored.error().text();
    EXPECT_TRUE(server_->in_place());
    const Peer after(path_);
    EXPECT_TRUE(after.send(bytes("AFTER")));
    settle();
    EXPECT_EQ(heard_.back(), "AFTER");
  }
  send(connection, bytes("STATE"));
  EXPECT_EQ(before.read(), bytes("STATE")) << "connections go on";
  EXPECT_NE(refused(path_), "opened");
}

TEST_F(ServerTest, ASocketOfAnotherDaemonIsNotTakenFromIt) {
  open();
  std::filesystem::remove_all(std::filesystem::path(path_).parent_path());
  auto other = Server::open(path_, "");
  ASSERT_TRUE(other);
  const auto restored = server_->restore();
  ASSERT_FALSE(restored);
  EXPECT_THAT(restored.error().text(), HasSubstr("another daemon has this control socket"));
  server_.reset();
  EXPECT_TRUE(Peer(path_).connected()) << "it is the other one's, and stays";
}

TEST_F(ServerTest, ClosingWithinAHandlerIsSafe) {
  open({.unread_bytes = 10});
  const Peer peer(path_);
  // The kernel has room for the first ones.
  on_packet_ = [this] {
    for (int i = 0; i < 1000; ++i) send(last_, bytes("MORE_THAN_ALLOWED", 4000));
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(peer.send(bytes("A")));
  settle();
  EXPECT_THAT(heard_, ElementsAre("A"));
  EXPECT_EQ(server_->connections(), 0u);
  send(last_, bytes("LATE"));
}

// A client that has its answer leaves, while the daemon sends what has happened since.
TEST_F(ServerTest, WhoHasLeftIsNoInvalidMessage) {
  open();
  Peer peer = connect();
  peer.leave();
  send(last_, bytes("STATE"));
  settle();
  EXPECT_EQ(closed_, 1);
  EXPECT_EQ(server_->dropped(), 0u);
}

TEST_F(ServerTest, WhatSomebodyHasSentWhoHasLeftIsTaken) {
  open();
  Peer heard_before = connect();
  send(last_, bytes("STATE"));  // is never read
  ASSERT_TRUE(heard_before.send(bytes("MOVE")));
  heard_before.leave();
  settle();
  Peer heard_behind = connect();
  ASSERT_TRUE(heard_behind.send(bytes("MOVE")));
  ASSERT_TRUE(heard_behind.send(bytes("STOP")));
  heard_behind.leave();
  send(last_, bytes("STATE"));
  settle();
  EXPECT_EQ(heard_, (std::vector<std::string>{"MOVE", "MOVE", "STOP"}));
  EXPECT_EQ(closed_, 2);
  EXPECT_EQ(server_->dropped(), 0u);
}

TEST_F(ServerTest, AThousandConnectionsSurviveAndOneMoreMayStop) {
  rlimit files{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &files), 0);
  files.rlim_cur = files.rlim_max;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &files), 0);
  if (files.rlim_max < 2200) GTEST_SKIP() << "too few descriptors allowed here";
  open({.places = {.in_all = 1000, .of_user = 2000, .of_process = 2000}});
  std::vector<Peer> peers = connect_many(1000);
  EXPECT_EQ(server_->connections(), 1000u);
  EXPECT_EQ(why_stops_only_, "");
  const Peer more = connect();
  EXPECT_FALSE(more.hung_up());
  EXPECT_THAT(why_stops_only_, HasSubstr("1000 connections"));
  for (const Peer& peer : peers) EXPECT_TRUE(peer.send(bytes("HELLO")));
  settle();
  EXPECT_EQ(heard_.size(), 1000u);
  peers.clear();
  settle();
  EXPECT_EQ(server_->connections(), 1u);
  EXPECT_TRUE(Peer(path_).connected());
}

TEST_F(ServerTest, WithoutDescriptorsConnectionsAreTurnedAway) {
  open();
  std::vector<Peer> waiting;
  for (int i = 0; i < 5; ++i) waiting.emplace_back(path_);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit few{.rlim_cur = 100, .rlim_max = before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  std::vector<int> taken;
  for (int fd = ::dup(0); fd >= 0; fd = ::dup(0)) taken.push_back(fd);
  settle();
  for (const int fd : taken) ::close(fd);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  settle();
  for (const Peer& peer : waiting) EXPECT_TRUE(peer.hung_up());
  EXPECT_EQ(server_->dropped(), 5u);
  EXPECT_TRUE(Peer(path_).connected());
}

}  // namespace
}  // namespace bushd::control::server_test
