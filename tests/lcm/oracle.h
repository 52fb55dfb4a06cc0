// lcm-gen's types as they encode and decode by themselves.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <vector>

namespace bushd::test {

template <class Oracle>
std::vector<std::uint8_t> bytes_of(const Oracle& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  const int size = static_cast<int>(bytes.size());
  EXPECT_EQ(message.encode(bytes.data(), 0, size), size);
  return bytes;
}

template <class Oracle>
Oracle as(std::span<const std::uint8_t> bytes) {
  Oracle message{};
  const int size = static_cast<int>(bytes.size());
  EXPECT_EQ(message.decode(bytes.data(), 0, size), size) << Oracle::getTypeName();
  return message;
}

}  // namespace bushd::test
