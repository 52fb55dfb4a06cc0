// Requests that arrive as they were meant.
#pragma once

#include <gtest/gtest.h>

#include <variant>

#include "api/printed.h"
#include "lcm/codec.h"

namespace bushd::test {

inline const lcm::RequestId kId{.session = -7, .client_id = "scan-hall-4711", .number = 1};

// Encoded and decoded it is the same, and encoded again too.
inline void expect_arrives(const api::Request& request) {
  const auto packet = lcm::encode(12, kId, request);
  ASSERT_TRUE(packet) << packet.error().text();
  const auto message = lcm::decode_client_message(packet->channel, packet->payload);
  ASSERT_TRUE(message) << packet->channel;
  EXPECT_EQ(message->id, kId);
  ASSERT_TRUE(std::holds_alternative<api::Request>(message->content)) << packet->channel;
  const auto& arrived = std::get<api::Request>(message->content);
  EXPECT_EQ(arrived, request);
  const auto again = lcm::encode(12, message->id, arrived);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->payload, packet->payload);
  EXPECT_EQ(again->channel, packet->channel);
}

}  // namespace bushd::test
