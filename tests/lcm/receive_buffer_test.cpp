// A burst of datagrams that nobody reads yet, and how many of it the kernel keeps.
#include "lcm/receive_buffer.h"

#include <gtest/gtest.h>

#include <string>

#include "lcm/loopback_pair.h"

namespace bushd::lcm {
namespace {

int receive_buffer(int socket) {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  EXPECT_EQ(getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, &size), 0);
  return bytes;
}

class ReceiveBuffer : public test::LoopbackPair {
 protected:
  void limit(int bytes) const {
    ASSERT_EQ(setsockopt(receiver_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes), 0);
  }
  // How many are kept of so many that are sent at once.
  int kept(int datagrams) const {
    for (int i = 0; i < datagrams; ++i) send_one(std::string(2000, 'x'));
    int kept = 0;
    while (receive_one()) ++kept;
    return kept;
  }
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
