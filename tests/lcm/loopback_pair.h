// Two UDP sockets of this PC: what one sends, the other receives. Over loopback a datagram has
// arrived, or has been dropped, when send() returns.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace bushd::test {

class LoopbackPair : public testing::Test {
 protected:
  LoopbackPair() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(receiver_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(getsockname(receiver_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(connect(sender_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~LoopbackPair() override {
    close(receiver_);
    close(sender_);
  }
  void send_one(const std::string& datagram) const {
    EXPECT_GE(send(sender_, datagram.data(), datagram.size(), 0), 0);
  }
  bool receive_one() const {
    char first = 0;
    return recv(receiver_, &first, 1, MSG_DONTWAIT | MSG_TRUNC) >= 0;
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int sender_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

}  // namespace bushd::test
