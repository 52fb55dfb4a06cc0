// Requests that arrive as they were meant.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "base/fields_json.h"
#include "base/json_text.h"
#include "lcm/codec.h"

namespace bushd::test {

inline const lcm::RequestId kId{.session = -7, .client_id = "scan-hall-4711", .number = 1};

inline std::string text_of(const api::Request& request) {
  return std::visit([](const auto& content) { return json_text(json_of(content)); },
                    static_cast<const api::Request::variant&>(request));
}

// Encoded and decoded it is the same, and encoded again too.
inline void expect_arrives(const api::Request& request) {
  const auto packet = lcm::encode(12, kId, request);
  ASSERT_TRUE(packet) << packet.error().text();
  const auto message = lcm::decode_client_message(packet->channel, packet->payload);
  ASSERT_TRUE(message) << packet->channel;
  EXPECT_EQ(message->id, kId);
  const auto& arrived = std::get<api::Request>(message->content);
  EXPECT_TRUE(arrived == request) << text_of(request) << ", arrived " << text_of(arrived);
  const auto again = lcm::encode(12, message->id, arrived);
  EXPECT_EQ(again->payload, packet->payload);
  EXPECT_EQ(again->channel, packet->channel);
}

}  // namespace bushd::test
