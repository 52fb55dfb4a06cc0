// Random payloads of any message type, made from its layout alone.
#pragma once

#include <cstdint>
#include <vector>

#include "lcm/layout.h"
#include "lcm/messages.h"
#include "lcm/types.h"
#include "lcm/wire.h"

namespace bushd::test {

class PayloadMaker {
 public:
  explicit PayloadMaker(Random& random) : random_(random) {}

  template <class T>
  std::vector<std::uint8_t> make() {
    bytes_.clear();
    put(static_cast<std::uint64_t>(T::getHash()), 8);
    walk(lcm::layout_of<T>());
    return bytes_;
  }

 private:
  void put(std::uint64_t value, int size) {
    for (int shift = (size - 1) * 8; shift >= 0; shift -= 8) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> shift));
    }
  }
  void put_text() {
    const std::string word = text(random_);
    put(word.size() + 1, 4);
    bytes_.insert(bytes_.end(), word.begin(), word.end());
    bytes_.push_back(0);
  }
  void put_number(char field) {
    const int size = field == 'b' ? 1 : field == 'h' ? 2 : field == 'i' ? 4 : 8;
    // Of doubles, some that are numbers: others compare unequal to themselves.
    put(field == 'd' ? std::uint64_t{0x3FF0} << 48 | below(random_, 1 << 20) : random_(), size);
  }
  void walk(const lcm::Layout& layout) {
    std::size_t count = 0;
    auto nested = layout.nested.begin();
    for (const char field : layout.fields) {
      const bool array = field < 'a';
      if (field == 'n') {
        count = below(random_, 4);
        put(count, 4);
        continue;
      }
      const std::size_t elements = array ? count : 1;
      const char kind = static_cast<char>(field | 0x20);
      for (std::size_t i = 0; i < elements; ++i) {
        if (kind == 's') {
          put_text();
        } else if (kind == 't') {
          walk(**nested);
        } else {
          put_number(kind);
        }
      }
      if (kind == 't') ++nested;
    }
  }

  Random& random_;
  std::vector<std::uint8_t> bytes_;
};

template <class T>
T random_message(Random& random) {
  return lcm::decode<T>(PayloadMaker(random).make<T>()).value();
}

}  // namespace bushd::test
