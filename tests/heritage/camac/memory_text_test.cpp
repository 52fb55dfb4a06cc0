#include "heritage/camac/memory_text.h"

#include <gtest/gtest.h>

namespace bushd::camac::memory_text_test {
namespace {

TEST(MemoryText, BytesComeBack) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 256; ++i) bytes.push_back(static_cast<std::uint8_t>(i));
  EXPECT_EQ(bytes_of(to_text(bytes)), bytes);
  EXPECT_EQ(to_text(std::vector<std::uint8_t>{0, 0xA5, 0xFF}), "00a5ff");
  EXPECT_EQ(bytes_of(""), std::vector<std::uint8_t>{});
}

TEST(MemoryText, OtherTextIsNone) {
  for (const char* text : {"0", "0g", "A5", "00 5", "0x00"}) EXPECT_FALSE(bytes_of(text)) << text;
}

}  // namespace
}  // namespace bushd::camac::memory_text_test
