// A burst of datagrams that nobody reads yet, and how many of it the kernel keeps.
#include "lcm/receive_buffer.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace bushd::lcm {
namespace {

int receive_buffer(int socket) {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  EXPECT_EQ(getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, &size), 0);
  return bytes;
}

class ReceiveBuffer : public testing::Test {
 protected:
  ReceiveBuffer() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(receiver_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(getsockname(receiver_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(connect(sender_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~ReceiveBuffer() override {
    close(receiver_);
    close(sender_);
  }
  void limit(int bytes) const {
    ASSERT_EQ(setsockopt(receiver_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes), 0);
  }
  // How many are kept of so many that are sent at once.
  int kept(int datagrams) const {
    const std::string datagram(2000, 'x');
    for (int i = 0; i < datagrams; ++i) {
      EXPECT_GE(send(sender_, datagram.data(), datagram.size(), 0), 0);
    }
    char heard = 0;
    int kept = 0;
    while (recv(receiver_, &heard, 1, MSG_DONTWAIT | MSG_TRUNC) > 0) ++kept;
    return kept;
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int sender_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST_F(ReceiveBuffer, HasRoomForTheStateOfManyMotors) {
  limit(64 * 1024);
  EXPECT_LT(kept(300), 300);
  const int before = receive_buffer(receiver_);
  enlarge_receive_buffer(receiver_);
  EXPECT_GT(receive_buffer(receiver_), before);
  if (receive_buffer(receiver_) < 2 * kReceiveBufferBytes) {
    GTEST_SKIP() << "net.core.rmem_max allows no more than " << receive_buffer(receiver_);
  }
  EXPECT_EQ(kept(300), 300);
}

TEST_F(ReceiveBuffer, IsNeverMadeSmaller) {
  enlarge_receive_buffer(receiver_);
  const int before = receive_buffer(receiver_);
  enlarge_receive_buffer(receiver_);
  EXPECT_EQ(receive_buffer(receiver_), before);
}

}  // namespace
}  // namespace bushd::lcm
