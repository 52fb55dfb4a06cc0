#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/properties.h"

namespace bushd::test::crc_test {
namespace {

// The definition: one bit of the message at a time, each byte's lowest first, through 0x04C11DB7
// read backwards.
uint32_t bitwise(uint32_t crc, const std::vector<uint8_t>& data) {
  for (const uint8_t byte : data) {
    for (int bit = 0; bit < 8; ++bit) {
      const bool feedback = ((crc ^ static_cast<uint32_t>(byte >> bit)) & 1) != 0;
      crc >>= 1;
      if (feedback) crc ^= 0xEDB88320;
    }
  }
  return crc;
}

uint32_t engine(uint32_t crc, const std::vector<uint8_t>& data) {
  return bushd_crc32(crc, data.data(), data.size());
}

TEST(Crc, HasTheCheckValueOfTheCatalogue) {
  const char* digits = "123456789";
  EXPECT_EQ(~bushd_crc32(BUSHD_CRC32_START, reinterpret_cast<const uint8_t*>(digits), 9),
            0xCBF43926);
}

TEST(Crc, OfNothingIsTheStartValue) {
  const uint8_t none = 0;
  EXPECT_EQ(bushd_crc32(0x1234, &none, 0), 0x1234u);
}

// Every entry of every slice is reached by one of these: a single bit at each place of a 16-byte
// round.
TEST(Crc, AgreesWithTheDefinitionForEverySingleByteValueAtEveryPlace) {
  for (size_t place = 0; place < 16; ++place) {
    for (int value = 0; value < 256; ++value) {
      std::vector<uint8_t> data(16, 0);
      data[place] = static_cast<uint8_t>(value);
      ASSERT_EQ(engine(0, data), bitwise(0, data)) << place << ' ' << value;
    }
  }
}

TEST(Crc, AgreesWithTheDefinitionForAnyBytes) {
  holds("crc == bitwise definition", [] {
    const auto size = between<size_t>(0, 300);
    const auto data =
        *rc::gen::container<std::vector<uint8_t>>(size, rc::gen::arbitrary<uint8_t>());
    const auto start = *rc::gen::arbitrary<uint32_t>();
    RC_ASSERT(engine(start, data) == bitwise(start, data));
  });
}

TEST(Crc, MayBeComputedInPieces) {
  holds("crc of a whole == crc continued over its parts", [] {
    const auto data = *rc::gen::container<std::vector<uint8_t>>(100, rc::gen::arbitrary<uint8_t>());
    const auto cut = between<size_t>(0, data.size());
    const uint32_t head = bushd_crc32(BUSHD_CRC32_START, data.data(), cut);
    RC_ASSERT(bushd_crc32(head, data.data() + cut, data.size() - cut) ==
              engine(BUSHD_CRC32_START, data));
  });
}

}  // namespace
}  // namespace bushd::test::crc_test
