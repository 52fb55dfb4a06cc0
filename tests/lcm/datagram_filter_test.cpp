// What the kernel lets through to a socket.
#include "lcm/datagram_filter.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace bushd::lcm {
namespace {

using testing::ElementsAre;

class DatagramFilter : public testing::Test {
 protected:
  DatagramFilter() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(receiver_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(getsockname(receiver_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(connect(sender_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~DatagramFilter() override {
    close(receiver_);
    close(sender_);
  }
  static std::string message(const std::string& channel, const std::string& magic = "LC02") {
    return magic + "seqn" + channel + std::string("\0payload", 8);
  }
  // Over loopback a datagram has arrived, or has been dropped, when send() returns.
  std::vector<std::string> passed(const std::vector<std::string>& datagrams) const {
    std::vector<std::string> through;
    for (const std::string& datagram : datagrams) {
      EXPECT_GE(send(sender_, datagram.data(), datagram.size(), 0), 0);
      std::string heard(100, '\0');
      const ssize_t n = recv(receiver_, heard.data(), heard.size(), MSG_DONTWAIT);
      if (n >= 0) through.push_back(datagram);
    }
    return through;
  }

  int receiver_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int sender_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

TEST_F(DatagramFilter, TakesWholeMessagesOnly) {
  ASSERT_TRUE(accept_whole_messages_only(receiver_));
  EXPECT_THAT(
      passed({message("A"), message("A", "LC03"), "", "LC0", "LC02", "junk of some length"}),
      ElementsAre(message("A"), "LC02"));
}

TEST_F(DatagramFilter, TakesTheseChannelsOnly) {
  ASSERT_TRUE(accept_whole_messages_only(receiver_, {"B_STOP", "B_EMERGENCY_STOP"}));
  EXPECT_THAT(
      passed({message("B_STOP"), message("B_EMERGENCY_STOP"), message("B_MOVE"), message("B_STO"),
              message("B_STOPP"), message("C_STOP"), message("B_EMERGENCY_STO"),
              message("B_STOP", "LC03"), message(""), "LC02seqnB_STOP", "LC02"}),
      ElementsAre(message("B_STOP"), message("B_EMERGENCY_STOP")));
}

TEST_F(DatagramFilter, TakesAllButUnheardChannels) {
  ASSERT_TRUE(accept_whole_messages_only(receiver_, {}, {"B_STATE", "B_HEALTH"}));
  EXPECT_THAT(
      passed({message("B_STATE"), message("B_HEALTH"), message("B_MOVE"), message("B_STAT"),
              message("B_STATES"), message("C_STATE"), message("B_MOVE", "LC03"), message("")}),
      ElementsAre(message("B_MOVE"), message("B_STAT"), message("B_STATES"), message("C_STATE"),
                  message("")));
}

TEST_F(DatagramFilter, HoldsForTheLongestNames) {
  const std::string longest(63, 'x');
  ASSERT_TRUE(accept_whole_messages_only(receiver_, {longest, longest.substr(1), "a", "b"}));
  EXPECT_THAT(passed({message(longest), message(longest.substr(1)), message(longest.substr(2)),
                      message("b"), message(longest + "x")}),
              ElementsAre(message(longest), message(longest.substr(1)), message("b")));
}

}  // namespace
}  // namespace bushd::lcm
