// What the kernel lets through to a socket.
#include "lcm/datagram_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "lcm/loopback_pair.h"

namespace bushd::lcm {
namespace {

using testing::ElementsAre;

class DatagramFilter : public test::LoopbackPair {
 protected:
  static std::string message(const std::string& channel, const std::string& magic = "LC02") {
    return magic + "seqn" + channel + std::string("\0payload", 8);
  }
  std::vector<std::string> passed(const std::vector<std::string>& datagrams) const {
    std::vector<std::string> through;
    for (const std::string& datagram : datagrams) {
      send_one(datagram);
      if (receive_one()) through.push_back(datagram);
    }
    return through;
  }
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
