#include "control/packet.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <string>

namespace bushd::control::packet_test {
namespace {

std::vector<std::uint8_t> bytes(const std::string& text) {
  return {text.begin(), text.end()};
}

TEST(Packet, HoldsChannelAndMessage) {
  const auto packet = packet_of({.channel = "MOVE", .payload = {1, 0, 2}});
  const auto view = view_of(packet);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->channel, "MOVE");
  EXPECT_EQ(std::vector<std::uint8_t>(view->payload.begin(), view->payload.end()),
            (std::vector<std::uint8_t>{1, 0, 2}));
}

TEST(Packet, NeedsAName) {
  EXPECT_FALSE(view_of({}));
  EXPECT_FALSE(view_of(bytes(std::string(1, '\0'))));
  EXPECT_FALSE(view_of(bytes("MOVE")));
  EXPECT_FALSE(view_of(bytes(std::string(64, 'x') + std::string(1, '\0'))));
  EXPECT_TRUE(view_of(bytes(std::string(63, 'x') + std::string(1, '\0'))));
}

TEST(Packet, AnyBytesAreSafe) {
  rc::check([](const std::vector<std::uint8_t>& any) {
    const auto view = view_of(any);
    if (!view) return;
    RC_ASSERT(view->channel.size() + 1 + view->payload.size() == any.size());
  });
}

}  // namespace
}  // namespace bushd::control::packet_test
